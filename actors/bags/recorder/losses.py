"""Counts recorded and missing messages, by topic and publisher. Pure.

A publisher numbers its messages. Messages in a gap were lost on the way: dropped by the publisher's queue,
the broker or the recorder's subscription. Messages that arrived when the recorder's queue was full were
dropped.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

MAX_PUBLISHERS: Final = 1000
"""Limit for the publishers of a topic with counts of their own. The topic's counts include all."""
MAX_GAPS: Final = 100
"""Limit for the gaps that are listed per publisher: the newest."""


class PublisherLosses:
    """Counts of one publisher's missing messages.

    Attributes:
        node: The full name of its node.
        lost: Number of messages that did not arrive.
        dropped: Number of messages that arrived when the recorder's queue was full.
    """

    __slots__ = ("_expected", "_gaps", "dropped", "lost", "node")

    def __init__(self, node: str, number: int) -> None:
        self.node = node
        self.lost = self.dropped = 0
        self._expected = number
        self._gaps: list[list[int]] = []

    def note(self, number: int) -> None:
        """Note that a message has arrived.

        Args:
            number: Its number. A number below the preceding one belongs to a repeated latched message, and
                does not end a gap.
        """
        if number > self._expected:
            self.lost += number - self._expected
            self._add(self._expected, number - self._expected)
        if number >= self._expected:
            self._expected = number + 1

    def drop(self, number: int) -> None:
        """Count a noted message as dropped."""
        self.dropped += 1
        self._add(number, 1)

    def _add(self, first: int, count: int) -> None:
        if self._gaps and sum(self._gaps[-1]) == first:
            self._gaps[-1][1] += count
            return
        self._gaps.append([first, count])
        if len(self._gaps) > MAX_GAPS:
            del self._gaps[0]

    def document(self) -> dict[str, Any]:
        """Return the counts, and the newest gaps as pairs of first number and length."""
        return {"lost": self.lost, "dropped": self.dropped, "gaps": [list(each) for each in self._gaps]}


class TopicCounts:
    """Counts of one topic.

    Attributes:
        received: Number of messages that arrived while the recorder was not paused.
        written: Number of messages in the bag. Those of chunks that could not be written are subtracted at
            the end.
        dropped: Number of messages that arrived when the queue was full.
        unwritten: Number of messages that were queued when the writer failed, or arrived later.
        invalid: Number of messages that cannot be decoded as the topic's type, or not encoded as CDR.
    """

    __slots__ = ("_publishers", "dropped", "invalid", "received", "unwritten", "written")

    def __init__(self) -> None:
        self.received = self.written = self.dropped = self.unwritten = self.invalid = 0
        self._publishers: dict[bytes, PublisherLosses] = {}

    def note(self, gid: bytes, node: str, number: int) -> None:
        """Note a message that has arrived, whether or not it is written.

        Args:
            gid: Identifies the publisher.
            node: The full name of its node.
            number: The message's number.
        """
        known = self._publishers.get(gid)
        if known is None:
            if len(self._publishers) >= MAX_PUBLISHERS:
                return
            known = self._publishers[gid] = PublisherLosses(node, number)
        known.note(number)

    def drop(self, gid: bytes, number: int) -> None:
        """Count a noted message as dropped."""
        self.dropped += 1
        known = self._publishers.get(gid)
        if known is not None:
            known.drop(number)

    def lost(self, now: int = 0) -> int:
        """Return the number of messages that did not arrive.

        Args:
            now: Losses that the subscription has counted, with messages before the first received one.
        """
        return max(now, sum(each.lost for each in self._publishers.values()))

    def document(self, lost: int) -> dict[str, Any]:
        """Return the counts of missing messages, as data for JSON; empty if no message is missing.

        Args:
            lost: The result of `lost`.
        """
        dropped = self.dropped + self.unwritten
        if not (lost or dropped or self.invalid):
            return {}
        publishers: dict[str, dict[str, Any]] = {}
        for each in self._publishers.values():
            if each.lost or each.dropped:
                name = each.node if each.node not in publishers else f"{each.node} ({len(publishers) + 1})"
                publishers[name] = each.document()
        return {"lost": lost, "dropped": dropped, "invalid": self.invalid, "publishers": publishers}


def losses_of(counts: Mapping[str, TopicCounts], lost: Mapping[str, int]) -> dict[str, dict[str, Any]]:
    """Return the counts of missing messages for the metadata of a bag, by topic.

    Args:
        counts: The counts of each topic.
        lost: The number of messages that did not arrive, by topic.
    """
    found = {name: each.document(lost.get(name, 0)) for name, each in counts.items()}
    return {name: document for name, document in found.items() if document}
