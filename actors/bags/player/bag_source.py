"""Reads and converts the selected topics of bags. Blocking; used in the player's thread."""

from __future__ import annotations

import heapq
from operator import attrgetter
from typing import TYPE_CHECKING, Final

from actors.bags.contents.records import CDR
from actors.bags.errors import BagError
from actors.bags.player.played_service import PlayedService, has_service_events
from actors.bags.player.played_topic import DueMessage, PlayedTopic
from actors.bags.reader import Reader
from actors.bags.storage.bag_file import Order
from actors.endpoints.service_introspection import TOPIC_SUFFIX
from actors.interfaces.errors import InvalidMessageError
from proto.errors import CallboardError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Generator, Sequence
    from pathlib import Path

    from actors.bags.contents.records import BagTopic
    from actors.bags.player.played_service import RequestsSource
    from actors.bags.reader import BagSummary
    from actors.bags.selection import Selection


MAX_TOPICS: Final = 10_000
"""Limit for the topics of a bag that are played: a type that is not installed takes 4 ms and 8 KB."""


class BagSource:
    """The topics of bags to play, and their messages.

    Args:
        paths: The bags; their messages are merged by time.
        selection: The topics to play.
        excluded: Names of topics not to play, even if they are selected.
        order: The times by which messages are played.
        requests: The service events to send as requests; None: all are published as they are.

    Attributes:
        topics: The topics that can be played, of all bags.
        problems: Why other selected topics cannot be played, each in one sentence.
        start_ns: Log time of the first message.
        end_ns: Log time of the last message.

    Raises:
        BagError: A bag cannot be read, or there are no messages.
    """

    def __init__(
        self,
        paths: Sequence[Path],
        selection: Selection,
        excluded: frozenset[str],
        order: Order,
        requests: RequestsSource | None = None,
    ) -> None:
        self._bags: list[_Bag] = []
        try:
            for path in paths:
                self._bags.append(_Bag(Reader(path), order))
            # From the files, since metadata.yaml has no definitions of types.
            summaries = [each.reader.summary(quick=False) for each in self._bags]
            filled = [each for each in summaries if each.message_count]
            if not filled:
                bags = " and ".join(map(str, paths))
                raise BagError(f"{bags} {'has' if len(paths) == 1 else 'have'} no messages")
            self.problems: list[str] = []
            for bag, summary in zip(self._bags, summaries, strict=True):
                self.problems += bag.choose(summary, selection, excluded, requests)
            names = {each.topic.name for summary in summaries for each in summary.topics}
            wanted = [*selection.topics, *(f"{each}{TOPIC_SUFFIX}" for each in selection.services)]
            self.problems += [
                f"'{escape(each)}' is not played: there is no such topic"
                for each in wanted
                if each not in names
            ]
        except BaseException:
            self.close()
            raise
        self.topics = [topic for bag in self._bags for topic in bag.topics.values()]
        self.start_ns = min(each.start_ns for each in filled)
        self.end_ns = max(each.end_ns for each in filled)

    def messages(self, from_ns: int | None) -> Generator[DueMessage]:
        """Yield messages as msgpack, in order; count invalid ones instead.

        Messages of the same time are in the order of the bags, and of one bag in the order of its files.

        Args:
            from_ns: Least time; None for no limit.

        Raises:
            BagError: A bag is damaged.
        """
        if len(self._bags) == 1:
            yield from self._bags[0].messages(from_ns)
        else:
            streams = (each.messages(from_ns) for each in self._bags)
            yield from heapq.merge(*streams, key=attrgetter("time_ns"))

    def close(self) -> None:
        """Close the bags."""
        for each in self._bags:
            each.reader.close()


class _Bag:
    """One of the bags, with the topics that are played of it."""

    def __init__(self, reader: Reader, order: Order) -> None:
        self.reader = reader
        self._order = order
        self.topics: dict[tuple[str, str, str], PlayedTopic] = {}

    def choose(
        self,
        summary: BagSummary,
        selection: Selection,
        excluded: frozenset[str],
        requests: RequestsSource | None,
    ) -> list[str]:
        """Choose its topics; return why others cannot be played, or parts of the bag."""
        problems: list[str] = []
        selected = [
            each
            for each in summary.topics
            if each.topic.name not in excluded
            and selection.selects_name(each.topic.name, each.topic.type_name)
        ]
        if len(selected) > MAX_TOPICS:
            count = len(selected) - MAX_TOPICS
            problems.append(f"{count:,} more topics are not played; the limit is {MAX_TOPICS:,}")
        for counted in selected[:MAX_TOPICS]:
            topic = counted.topic
            try:
                self.topics[topic.key] = _played(topic, requests)
            except (CallboardError, TypeError) as error:
                if counted.message_count:
                    problems.append(f"'{escape(topic.name)}' is not played: {error}")
        return [*problems, *summary.problems]

    def messages(self, from_ns: int | None) -> Generator[DueMessage]:
        """Yield messages; see `BagSource.messages`."""
        reader, by_publish_time = self.reader, self._order is Order.PUBLISH
        names = {each.name for each in self.topics.values()}
        start_ns = None if by_publish_time else from_ns
        # By identity: the reader yields one object for all messages of a topic in a file, and keeps it alive.
        known: dict[int, tuple[object, PlayedTopic | None]] = {}
        reader.current_path = None
        path, split = None, None
        for bag_topic, data, log_time_ns, publish_time_ns, _ in reader.messages(
            names, start_ns, order=self._order
        ):
            if reader.current_path is not path:
                if path is not None and reader.current_path is not None:
                    split = str(path.absolute()), str(reader.current_path.absolute())
                path = reader.current_path
            time_ns = publish_time_ns if by_publish_time else log_time_ns
            if from_ns is not None and time_ns < from_ns:
                continue
            found = known.get(id(bag_topic))
            if found is None:
                found = known[id(bag_topic)] = bag_topic, self._topic(bag_topic)
            topic = found[1]
            if topic is None:
                continue
            try:
                converted = topic.to_msgpack(data)
            except InvalidMessageError as error:
                topic.invalid += 1
                topic.problem = str(error)
                continue
            if converted is not None:
                yield DueMessage(topic, converted, time_ns, publish_time_ns, split)
                split = None

    def _topic(self, bag_topic: BagTopic) -> PlayedTopic | None:
        topic = self.topics.get(bag_topic.key)
        return topic if topic is not None and topic.is_played else None


def _played(topic: BagTopic, requests: RequestsSource | None) -> PlayedTopic:
    if topic.encoding != CDR:
        raise BagError(f"its messages are {escape(topic.encoding)}, not CDR")
    if requests is not None and has_service_events(topic):
        return PlayedService(topic, requests)
    return PlayedTopic(topic)
