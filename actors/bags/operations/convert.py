"""Writes a new bag from others: joins, selects, compresses, and turns SQLite files into MCAP files."""

from __future__ import annotations

import heapq
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

from actors.bags.contents.records import CDR
from actors.interfaces.definition_texts import canonical_definition, definition_text, has_stated_hash
from proto.errors import CallboardError
from proto.wire.type_hash import hash_of

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Sequence

    from actors.bags.contents.records import BagMessage, BagTopic
    from actors.bags.reader import Reader
    from actors.bags.writer import Writer


def convert(
    readers: Sequence[Reader],
    writer: Writer,
    topics: Collection[str] | None = None,
    start_ns: int | None = None,
    end_ns: int | None = None,
) -> Counter[str]:
    """Write the messages of bags into a new bag, ordered by log time.

    Missing definitions and type hashes are added if the types are installed.

    Args:
        readers: The bags.
        writer: The new bag.
        topics: Names of topics; None for all.
        start_ns: Least log time; None for no limit.
        end_ns: Greatest log time; None for no limit.

    Returns:
        The number of written messages, by topic.

    Raises:
        BagError: A bag cannot be read.
        BagWriteError: The new bag cannot be written.
    """
    for reader in readers:
        for topic in reader.topics:
            if topics is None or topic.name in topics:
                writer.add_topic(completed(topic))
    streams = [reader.messages(topics, start_ns, end_ns) for reader in readers]
    messages = streams[0] if len(streams) == 1 else heapq.merge(*streams, key=lambda each: each.log_time_ns)
    return copy_messages(messages, writer, complete=True)


def copy_messages(messages: Iterable[BagMessage], writer: Writer, *, complete: bool = False) -> Counter[str]:
    """Write messages; return their number by topic.

    Args:
        messages: The messages, ordered by log time.
        writer: The bag.
        complete: Whether to add missing definitions and type hashes.
    """
    counts: Counter[str] = Counter()
    numbers: dict[int, tuple[BagTopic, int]] = {}
    for topic, data, log_time_ns, publish_time_ns, sequence in messages:
        # By identity: comparing definitions is slow, and a reader yields one object for each topic.
        found = numbers.get(id(topic))
        if found is None:
            number = writer.add_topic(completed(topic) if complete else topic)
            found = numbers[id(topic)] = topic, number
        writer.write(found[1], data, log_time_ns, publish_time_ns, sequence)
        counts[topic.name] += 1
    return counts


def completed(topic: BagTopic) -> BagTopic:
    """Return a topic with its missing definition and type hash, if its type is installed.

    Args:
        topic: The topic. SQLite files of ROS 2 Humble, for example, have neither.
    """
    if topic.encoding != CDR:
        return topic
    try:
        if not topic.definition_format:
            cls = topic.message_class()
            topic = replace(topic, definition=definition_text(cls), definition_format="ros2msg")
        if not topic.type_hash and has_stated_hash(topic.type_name):
            found = canonical_definition(topic.type_name, topic.definition, topic.definition_format)
            return replace(topic, type_hash=hash_of(found))
    except CallboardError:  # the type is not installed, or its definition is invalid
        pass
    return topic
