"""What a broker has done before, also while it is gone: rejections, and how much it has changed of late.

Time is counted in heartbeats of this broker, one a second.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

FIRST_BAN: Final = 5
"""Heartbeats for which a broker is ignored after its first rejection. Each further one doubles them."""

MAX_BAN: Final = 320
"""Heartbeats for which a broker is ignored at most: a mended one is back within minutes."""

FORGIVEN: Final = 600
"""Heartbeats without a rejection after which the earlier ones do not count."""

MAX_CHANGES: Final = 200_000
"""Endpoints of one broker that may come or go at once: twice what one may have by default."""

CHANGES_PER_HEARTBEAT: Final = 5000
"""Of them that are allowed again with each heartbeat: at about 10 us each, 5 % of the event loop."""

MAX_STANDINGS: Final = 2000
"""Brokers that are remembered; beyond them the one that was added first is forgotten."""


@dataclass(slots=True)
class _Standing:
    """Rejections of a broker, for how long it is ignored and has kept the rules, and its changes left."""

    changes: int
    rejections: int = 0
    banned: int = 0
    good: int = 0


class Standings:
    """The standings of the brokers of which there is something to remember."""

    def __init__(self) -> None:
        self._standings: dict[int, _Standing] = {}

    @property
    def any_banned(self) -> bool:
        """Whether any broker is ignored."""
        return any(each.banned for each in self._standings.values())

    def ban(self, broker: int) -> None:
        """Ignore a broker for a while."""
        standing = self._standing(broker)
        standing.banned = min(FIRST_BAN << standing.rejections, MAX_BAN)
        standing.rejections = min(standing.rejections + 1, MAX_BAN.bit_length())
        standing.good = 0

    def end_ban(self, broker: int) -> None:
        """Let a broker come again. Its next ban is still longer than the last one."""
        if broker in self._standings:
            self._standings[broker].banned = 0

    def is_banned(self, broker: int) -> bool:
        """Return whether a broker is ignored."""
        return broker in self._standings and self._standings[broker].banned > 0

    def count_changes(self, broker: int, count: int = 1) -> None:
        """Count endpoints of a broker that come or go."""
        self._standing(broker).changes -= count

    def may_change(self, broker: int) -> bool:
        """Return whether endpoints of a broker may come and go now."""
        return broker not in self._standings or self._standings[broker].changes > 0

    def beat(self) -> list[int]:
        """Count a heartbeat; return the brokers that are not ignored any more."""
        back: list[int] = []
        for broker, each in tuple(self._standings.items()):
            each.changes = min(each.changes + CHANGES_PER_HEARTBEAT, MAX_CHANGES)
            if each.banned:
                each.banned -= 1
                if not each.banned:
                    back.append(broker)
                continue
            each.good += 1
            if each.good > FORGIVEN:
                each.rejections = 0
            if not each.rejections and each.changes == MAX_CHANGES:
                del self._standings[broker]
        return back

    def _standing(self, broker: int) -> _Standing:
        standing = self._standings.get(broker)
        if standing is None:
            if len(self._standings) >= MAX_STANDINGS:
                del self._standings[next(iter(self._standings))]
            standing = self._standings[broker] = _Standing(MAX_CHANGES)
        return standing
