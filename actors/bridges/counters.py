"""What has crossed a bridge, and what has not: counts by topic and service, and reasons."""

from __future__ import annotations

from collections import Counter, deque
from typing import TYPE_CHECKING, Any, Final

from actors.bridges.report import Reason

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actors.bridges.report import Refusal

MAX_REASONS: Final = 20
"""Reasons that are counted for one topic or service; further ones are counted as `OTHER`."""
OTHER: Final = "other"
MAX_FAILURES: Final = 50
"""The newest failures that are kept, such as names that ROS 2 refuses."""
MAX_ROWS: Final = 5000
"""Topics, and as many services, whose counts are kept: more than a bridge shows by default. Beyond it the
oldest are forgotten, because a program may make up a new name each time."""
MAX_DETAIL: Final = 300
"""Characters kept of a reason's newest example, which may contain a string of a peer."""

_Row = tuple[str, str, bool]
"""The name of a topic or service, its type, and whether it comes from the other network."""


class Counts:
    """Counts of one topic or service in one direction.

    Attributes:
        received: Messages or requests that have arrived.
        sent: Messages passed on, or responses.
        repeated: Messages that arrived a second time: latched ones, after a subscription was made again.
        lost: Messages that the network lost before the bridge, by gaps in the publishers' sequence numbers.
        dropped: By reason, messages, requests and responses that did not cross.
        examples: By reason, a description of the newest one.
    """

    __slots__ = ("dropped", "examples", "lost", "received", "repeated", "sent")

    def __init__(self) -> None:
        self.received = self.sent = self.repeated = self.lost = 0
        self.dropped: Counter[str] = Counter()
        self.examples: dict[str, str] = {}

    def drop(self, reason: str, example: str = "", count: int = 1) -> None:
        """Count something that did not cross.

        Args:
            reason: A few words.
            example: What was wrong with it, if the reason does not say so.
            count: The number of messages, requests or responses.
        """
        if reason not in self.dropped and len(self.dropped) >= MAX_REASONS:
            reason = OTHER
        self.dropped[reason] += count
        if example:
            self.examples[reason] = example[:MAX_DETAIL]

    def document(self) -> dict[str, Any]:
        """Return the counts as a JSON object."""
        counts = {"received": self.received, "sent": self.sent, "repeated": self.repeated, "lost": self.lost}
        return {**counts, "dropped": dict(self.dropped), "examples": self.examples}


class Counters:
    """The counts of one bridge.

    Attributes:
        refusals: What does not cross now, and why.
    """

    def __init__(self) -> None:
        self.refusals: tuple[Refusal, ...] = ()
        self._topics: dict[_Row, Counts] = {}
        self._services: dict[_Row, Counts] = {}
        self._failures: deque[str] = deque(maxlen=MAX_FAILURES)

    def topic(self, name: str, type_name: str, *, from_theirs: bool) -> Counts:
        """Return the counts of a topic in one direction; they go on when it is gone and comes back.

        Args:
            name: Its full name where its messages come from.
            type_name: Its type.
            from_theirs: Whether they come from the other network.
        """
        return _counts(self._topics, (name, type_name, from_theirs))

    def service(self, name: str, *, from_theirs: bool) -> Counts:
        """Return the counts of the calls of a service; they go on as those of a topic do.

        Args:
            name: Its full name in the other network.
            from_theirs: Whether its clients are there, and its server here.
        """
        return _counts(self._services, (name, "", from_theirs))

    def failed(self, text: str) -> bool:
        """Note an error of one side; return whether it is a new one."""
        if text in self._failures:
            return False
        self._failures.append(text)
        return True

    def refuse(self, refusals: tuple[Refusal, ...]) -> list[Refusal]:
        """Replace what does not cross; return what is new in it, with each missing type only once."""
        known = {_news_of(each) for each in self.refusals}
        self.refusals = refusals
        fresh: dict[object, Refusal] = {}
        for each in refusals:
            if (news := _news_of(each)) not in known:
                fresh.setdefault(news, each)
        return list(fresh.values())

    def document(self) -> dict[str, Any]:
        """Return everything as a JSON object."""
        return {
            "topics": _rows(self._topics.items()),
            "services": _rows(self._services.items()),
            "refusals": [each._asdict() for each in self.refusals],
            "failures": list(self._failures),
        }


def _counts(rows: dict[_Row, Counts], row: _Row) -> Counts:
    counts = rows.pop(row, None) or Counts()
    if len(rows) >= MAX_ROWS:
        del rows[next(iter(rows))]
    rows[row] = counts  # the newest one
    return counts


def _news_of(refusal: Refusal) -> object:
    """Return a key that is equal for refusals of which one is worth a line in the log."""
    return refusal.type_name if refusal.reason is Reason.TYPE_MISSING else refusal


def _rows(counts: Iterable[tuple[_Row, Counts]]) -> list[dict[str, Any]]:
    return [
        {"name": name, "type": type_name, "from_theirs": from_theirs, **each.document()}
        for (name, type_name, from_theirs), each in sorted(counts, key=lambda item: item[0])
    ]
