"""Which of several bridges between two networks is active: a state machine without I/O or clock.

Two bridges between the same two networks would carry each message twice. Bridges see each other on both
sides: in callboard's graph by the labels of their nodes, in the other network by their ids. What both sides
show is a rival. (Two robots can have networks of one name that do not touch: their bridges see each other in
callboard only.) One of the rivals is active, and says so with a marker in callboard's graph; others wait.

    election = Election(own_id)
    active = election.update(now, bridges_in(labels, "ros2/7"), ids_in_the_other_network)

The bridge that is active stays; otherwise it is the one with the smallest id. A bridge that is killed leaves
callboard's graph at once, and the next one takes over, even while the other network still shows what the
killed one has left there. If in doubt, none is active: messages are lost then, and never doubled.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.bridges.graph import BRIDGE_ID_LABEL, BRIDGE_LABEL, BRIDGE_STATE_LABEL

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping

ACTIVE: Final = "active"
"""Value of the label of the node by which a bridge says that it is active.

It declares that node before its first mirror, and destroys it after its last one.
"""
SETTLE_SEC: Final = 3.0
"""How long to wait for a bridge that callboard shows to appear in the other network, before it counts as a
bridge of another one; and how long a bridge may need to say that it is active. Discovery takes a second at
most on a quiet network, and a takeover has 5 s."""

START_SEC: Final = 0.5
"""How long a bridge looks before it can be active at all: two may start at once, at two brokers of a mesh."""


def bridges_in(labels: Iterable[Mapping[str, str]], network: str) -> dict[str, bool]:
    """Return the bridges that callboard's graph shows: by their ids, whether they say that they are active.

    Args:
        labels: The labels of all nodes.
        network: The name of the other network, such as "ros2/7".
    """
    found: dict[str, bool] = {}
    for each in labels:
        bridge_id = each.get(BRIDGE_ID_LABEL)
        if bridge_id and each.get(BRIDGE_LABEL) == network:
            found[bridge_id] = each.get(BRIDGE_STATE_LABEL) == ACTIVE or found.get(bridge_id, False)
    return found


class _Seen:
    """How long another bridge has been known."""

    __slots__ = ("doubtful_at", "first_at", "is_there")

    def __init__(self, now: float) -> None:
        self.first_at = now
        """When it was first seen in callboard's graph."""
        self.is_there = False
        """Whether the other network shows it."""
        self.doubtful_at = now
        """Since when the other network does not show it."""


class Election:
    """Decides whether this bridge is active.

    Args:
        own_id: The id of this bridge; ids are compared as strings.
        settle_sec: How long to wait while it is not known whether a bridge is a rival.
        start_sec: How long to wait at first, and after `disconnect`.
    """

    def __init__(self, own_id: str, *, settle_sec: float = SETTLE_SEC, start_sec: float = START_SEC) -> None:
        self._own_id = own_id
        self._settle_sec = settle_sec
        self._start_sec = start_sec
        self._start_at: float | None = None
        """When it can be active; None before the first update."""
        self._seen: dict[str, _Seen] = {}
        self._active = False
        self._waits_for = ""

    @property
    def active(self) -> bool:
        """Whether this bridge is the active one."""
        return self._active

    @property
    def waits_for(self) -> str:
        """The id of the bridge because of which this one is not active; "" if it is, or has just started."""
        return self._waits_for

    def update(self, now: float, here: Mapping[str, bool], there: Collection[str]) -> bool:
        """Take note of the bridges that are visible, and return whether this one is active.

        Call it several times per second: the answer may change although both graphs have not.

        Args:
            now: A monotonic time in seconds.
            here: The bridges that callboard's graph shows, by their ids, as `bridges_in` returns them.
            there: The ids of the bridges that the other network shows.
        """
        if self._start_at is None:
            self._start_at = now + self._start_sec
        rivals = self._rivals(now, here, there)
        if self._active:
            # Networks that were apart have met: both bridges know it, and one of them goes on.
            stronger = (each for each in rivals if here[each] and each in there and each < self._own_id)
            self._waits_for = min(stronger, default="")
        else:
            self._waits_for = self._blocking(now, here, rivals)
        self._active = not self._waits_for and now >= self._start_at
        return self._active

    def disconnect(self) -> None:
        """Give up being active, because this bridge has lost callboard's graph and another one takes over."""
        self._active = False
        self._start_at = None
        self._waits_for = ""
        self._seen.clear()

    def _rivals(self, now: float, here: Mapping[str, bool], there: Collection[str]) -> list[str]:
        """Return the bridges that are, or may be, between the same two networks."""
        self._seen = {each: self._seen.get(each) or _Seen(now) for each in here if each != self._own_id}
        rivals: list[str] = []
        for each, seen in self._seen.items():
            if seen.is_there and each not in there:
                seen.doubtful_at = now
            seen.is_there = each in there
            if seen.is_there or now < seen.doubtful_at + self._settle_sec:
                rivals.append(each)
        return rivals

    def _blocking(self, now: float, here: Mapping[str, bool], rivals: list[str]) -> str:
        """Return the rival because of which this bridge may not become active, "" if there is none."""
        active = min((each for each in rivals if here[each]), default="")
        first = min(rivals, default="")
        # A bridge that has just come may be active, and its marker on the way.
        recent = (each for each in rivals if now < self._seen[each].first_at + self._settle_sec)
        return active or (first if first and first < self._own_id else min(recent, default=""))
