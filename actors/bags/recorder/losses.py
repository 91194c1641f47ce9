"""Counts of what reached a bag and what did not, by topic and publisher. Pure.

A publisher numbers its messages. A gap in its numbers was lost on the way: by its own queue, the broker or
the recorder's subscription. What was received and could not be kept was dropped: the queue was full.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

MAX_PUBLISHERS: Final = 1000
"""Publishers of a topic that are counted by themselves; the topic's own counts have all."""
MAX_GAPS: Final = 100
"""The newest gaps whose numbers are kept, of each publisher."""


class PublisherLosses:
    """What is known of one publisher's messages.

    Attributes:
        node: The full name of its node.
        lost: Messages that did not arrive.
        dropped: Messages that arrived and found the queue full.
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
            number: Its number; below the last one for a latched message, which no gap precedes.
        """
        if number > self._expected:
            self.lost += number - self._expected
            self._add(self._expected, number - self._expected)
        if number >= self._expected:
            self._expected = number + 1

    def drop(self, number: int) -> None:
        """Count a message that has been noted, and could not be kept."""
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
        """Return the counts, and the newest gaps as pairs of a first number and a count."""
        return {"lost": self.lost, "dropped": self.dropped, "gaps": [list(each) for each in self._gaps]}


class TopicCounts:
    """Counts of one topic.

    Attributes:
        received: Messages that arrived while nothing was paused.
        written: Messages in the bag; at its end without those of chunks that could not be written.
        dropped: Messages that arrived and found the queue full.
        unwritten: Messages that were on their way to the disk when the writer failed, or arrived later.
        invalid: Messages that are none of the topic's type, so that they cannot be written.
    """

    __slots__ = ("_before", "_publishers", "dropped", "invalid", "received", "unwritten", "written")

    def __init__(self) -> None:
        self.received = self.written = self.dropped = self.unwritten = self.invalid = 0
        self._publishers: dict[bytes, PublisherLosses] = {}
        self._before = 0
        """Messages that subscriptions which have gone had lost."""

    def note(self, gid: bytes, node: str, number: int) -> None:
        """Note a message that has arrived, whether or not it is written.

        Args:
            gid: The publisher.
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
        """Count a message that has arrived, and cannot be kept."""
        self.dropped += 1
        known = self._publishers.get(gid)
        if known is not None:
            known.drop(number)

    def subscription_ended(self, lost: int) -> None:
        """Note what a subscription had lost at its end: the next one counts from 0."""
        self._before += lost

    def lost(self, now: int = 0) -> int:
        """Return how many messages did not arrive.

        Args:
            now: What the subscription of now has lost. It knows of messages before the first one, too.
        """
        return max(self._before + now, sum(each.lost for each in self._publishers.values()))

    def document(self, lost: int) -> dict[str, Any]:
        """Return what is missing in the bag, as JSON has it; empty if nothing is.

        Args:
            lost: As `lost` returns it.
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
    """Return what is missing in a bag, by topic, as its metadata have it.

    Args:
        counts: By topic.
        lost: By topic, what did not arrive.
    """
    found = {name: each.document(lost.get(name, 0)) for name, each in counts.items()}
    return {name: document for name, document in found.items() if document}
