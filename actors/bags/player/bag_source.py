"""Reads and converts the selected topics of a bag. Blocking; used in the player's thread."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.bags.contents.records import CDR
from actors.bags.errors import BagError
from actors.bags.player.played_topic import DueMessage, PlayedTopic
from actors.bags.reader import Reader
from actors.bags.storage.bag_file import Order
from actors.interfaces.errors import InvalidMessageError
from proto.errors import CallboardError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Generator
    from pathlib import Path

    from actors.bags.selection import Selection


class BagSource:
    """The topics of a bag to play, and their messages.

    Args:
        path: The bag.
        selection: The topics to play.
        excluded: Names of topics not to play, even if they are selected.
        order: The times by which messages are played.

    Attributes:
        topics: The topics that can be played.
        problems: Why other selected topics cannot be played, each in one sentence.
        start_ns: Log time of the bag's first message.
        end_ns: Log time of its last message.

    Raises:
        BagError: The bag cannot be read, or has no messages.
    """

    def __init__(self, path: Path, selection: Selection, excluded: frozenset[str], order: Order) -> None:
        self._reader = Reader(path)
        self._order = order
        self.topics: list[PlayedTopic] = []
        self.problems: list[str] = []
        try:
            # From the files, since metadata.yaml has no definitions of types.
            summary = self._reader.summary(quick=False)
            if not summary.message_count:
                raise BagError(f"{path} has no messages")
            for counted in summary.topics:
                topic = counted.topic
                if topic.name in excluded or not selection.selects_name(topic.name, topic.type_name):
                    continue
                try:
                    if topic.encoding != CDR:
                        raise BagError(f"its messages are {escape(topic.encoding)}, not CDR")
                    self.topics.append(PlayedTopic(topic))
                except (CallboardError, TypeError) as error:
                    if counted.message_count:
                        self.problems.append(f"'{escape(topic.name)}' is not played: {error}")
        except BaseException:
            self._reader.close()
            raise
        self.start_ns, self.end_ns = summary.start_ns, summary.end_ns
        self.problems += summary.problems
        self._by_key = {each.bag_topic.key: each for each in self.topics}

    def messages(self, from_ns: int | None) -> Generator[DueMessage]:
        """Yield messages as msgpack, in order; count invalid ones instead.

        Args:
            from_ns: Least time; None for no limit.

        Raises:
            BagError: The bag is damaged.
        """
        by_publish_time = self._order is Order.PUBLISH
        names = {each.name for each in self.topics}
        start_ns = None if by_publish_time else from_ns
        # By identity: the reader yields one object for all messages of a topic in a file, and keeps it alive.
        known: dict[int, tuple[object, PlayedTopic | None]] = {}
        for bag_topic, data, log_time_ns, publish_time_ns, _ in self._reader.messages(
            names, start_ns, order=self._order
        ):
            time_ns = publish_time_ns if by_publish_time else log_time_ns
            if from_ns is not None and time_ns < from_ns:
                continue
            found = known.get(id(bag_topic))
            if found is None:
                found = known[id(bag_topic)] = bag_topic, self._by_key.get(bag_topic.key)
            topic = found[1]
            if topic is None or topic.publisher is None:
                continue
            try:
                yield DueMessage(topic, topic.to_msgpack(data), time_ns, publish_time_ns)
            except InvalidMessageError as error:
                topic.invalid += 1
                topic.problem = str(error)

    def close(self) -> None:
        """Close the bag."""
        self._reader.close()
