"""Reads one MCAP file.

Messages are yielded by log time. The times of chunks may overlap: chunks that overlap are merged, and only
these are held in memory.
"""

from __future__ import annotations

import heapq
from array import array
from bisect import bisect_left, bisect_right
from collections import OrderedDict
from typing import TYPE_CHECKING, Final

from mcap.opcode import Opcode

from actors.bags.contents.records import BagMessage, TopicCount
from actors.bags.storage.bag_file import MAX_MESSAGE_BYTES, FileContents, Order
from actors.bags.storage.mcap_frames import HEAD, MAGIC, MESSAGE, McapFrames
from actors.bags.storage.mcap_summary import SummaryReader, indexes_by_time

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping
    from pathlib import Path

    from actors.bags.contents.records import BagTopic
    from actors.bags.storage.bag_file import Filter
    from actors.bags.storage.mcap_summary import ChunkPlace, Entries, Summary

CACHED_BYTES: Final = 256 * 1024 * 1024
"""Limit for decompressed chunks kept for merging. Beyond it, chunks are decompressed again when needed."""

MAX_OPEN_MESSAGES: Final = 50_000_000
"""Limit for the messages of overlapping chunks: 20 bytes are held for each. A compressed chunk of a few
kilobytes can have millions of them."""


class McapFile:
    """An open MCAP file: a `BagFile`.

    Args:
        path: The file.
        max_chunk_bytes: Limit for a chunk after decompression, and for a message.

    Attributes:
        path: The file.

    Raises:
        InvalidBagError: It is not an MCAP file.
    """

    def __init__(self, path: Path, *, max_chunk_bytes: int = MAX_MESSAGE_BYTES) -> None:
        self.path = path
        self._frames = McapFrames(path, max_chunk_bytes=max_chunk_bytes)
        self._reader = SummaryReader(self._frames)
        self._summary: Summary | None = None

    def close(self) -> None:
        """Close the file."""
        self._frames.close()

    def summary(self) -> Summary:
        """Return the summary of the file, with the offsets of its chunks.

        Raises:
            InvalidBagError: No part of it can be read.
        """
        if self._summary is None:
            self._summary = self._reader.read()
        return self._summary

    def salvage(self) -> list[str]:
        """Read all chunks; from now on, `messages` yields those of whole chunks.

        Returns:
            What is damaged, each in one sentence.
        """
        self._summary, problems = self._reader.salvage()
        self._summary.problem = ""
        return problems

    def contents(self) -> FileContents:
        """Return a summary of the file; see `BagFile.contents`."""
        summary = self.summary()
        topics = tuple(
            TopicCount(topic, summary.counts.get(number, 0)) for number, topic in summary.topics.items()
        )
        return FileContents(
            topics,
            summary.start_ns,
            summary.end_ns,
            self._frames.size,
            summary.problem,
            dict(summary.metadata),
        )

    def messages(self, chosen: Filter, order: Order) -> Iterator[BagMessage]:
        """Yield messages; see `BagFile.messages`."""
        summary = self.summary()
        numbers = {number for number, topic in summary.topics.items() if chosen.has_topic(topic)}
        if not numbers:
            return
        if not summary.chunks:
            yield from self._unchunked(summary, chosen, numbers, order)
            return
        places = [
            each
            for each in summary.chunks
            if chosen.overlaps(each.start_ns, each.end_ns) and each.has_any(numbers)
        ]
        if order is not Order.FILE:
            yield from self._merged(summary, places, chosen, numbers)
            return
        for place in sorted(places, key=lambda each: each.offset):
            data = self._frames.chunk_data(place.offset)
            entries = self._reader.entries(data, place.offset, summary).chosen(numbers, chosen)
            yield from _messages(summary.topics, data, entries.starts)

    def _merged(
        self, summary: Summary, places: list[ChunkPlace], chosen: Filter, numbers: set[int]
    ) -> Iterator[BagMessage]:
        """Yield the messages of chunks by log time; equal times in the order of the file."""
        # A damaged index may list a chunk twice; the two would then be merged with each other for ever.
        waiting = iter(sorted({each.offset: each for each in places}.values()))
        following = next(waiting, None)
        cache = _ChunkCache(self._frames.chunk_data)
        heap: list[tuple[int, int, int]] = []
        open_chunks: dict[int, Entries] = {}
        open_messages = 0
        while heap or following is not None:
            while following is not None and (not heap or following.start_ns <= heap[0][0]):
                offset = following.offset
                entries = self._reader.entries(cache.get(offset), offset, summary).chosen(numbers, chosen)
                open_messages += len(entries.times)
                if open_messages > MAX_OPEN_MESSAGES:
                    self._frames.fail(
                        offset, f"more than {MAX_OPEN_MESSAGES:,} messages are in chunks whose times overlap"
                    )
                if entries.times:
                    open_chunks[offset] = entries = entries.by_time()
                    heapq.heappush(heap, (entries.times[0], offset, 0))
                else:
                    cache.drop(offset)
                following = next(waiting, None)
            if not heap:
                break
            _, offset, index = heapq.heappop(heap)
            times, starts, _ = open_chunks[offset]
            stop = len(times)
            # Yield all messages that precede those of other chunks: in most files, the whole chunk.
            if heap:
                other_ns, other, _ = heap[0]
                stop = (bisect_left if other < offset else bisect_right)(times, other_ns, index)
            if following is not None:
                stop = min(stop, bisect_left(times, following.start_ns, index))
            yield from _messages(summary.topics, cache.get(offset), starts[index:stop])
            if stop < len(times):
                heapq.heappush(heap, (times[stop], offset, stop))
            else:
                cache.drop(offset)
                open_messages -= len(times)
                del open_chunks[offset]

    def _unchunked(
        self, summary: Summary, chosen: Filter, numbers: set[int], order: Order
    ) -> Iterator[BagMessage]:
        """Yield the messages of a file without chunks, as rosbag2's preset `fastwrite` writes them."""
        times, offsets = array("Q"), array("Q")
        for record in self._frames.records(len(MAGIC), summary.end):
            if record.opcode == Opcode.MESSAGE:
                channel, log_time_ns = self._frames.message_head(record)
                if channel in numbers and chosen.overlaps(log_time_ns, log_time_ns):
                    times.append(log_time_ns)
                    offsets.append(record.start - HEAD.size)
        for index in range(len(times)) if order is Order.FILE else indexes_by_time(times):
            record = self._frames.record_at(offsets[index])
            if record.length > self._frames.max_chunk_bytes:
                limit = self._frames.max_chunk_bytes
                self._frames.fail(
                    record.start, f"a message has {record.length:,} bytes; the limit is {limit:,}"
                )
            data = self._frames.bytes_at(offsets[index], HEAD.size + record.length)
            yield from _messages(summary.topics, data, (0,))


class _ChunkCache:
    """Keeps decompressed chunks up to a limit, and reads a chunk again that it has dropped."""

    def __init__(self, read: Callable[[int], bytes]) -> None:
        self._read = read
        self._data: OrderedDict[int, bytes] = OrderedDict()
        self._bytes = 0

    def get(self, offset: int) -> bytes:
        data = self._data.get(offset)
        if data is not None:
            self._data.move_to_end(offset)
            return data
        data = self._data[offset] = self._read(offset)
        self._bytes += len(data)
        while self._bytes > CACHED_BYTES and len(self._data) > 1:
            self._bytes -= len(self._data.popitem(last=False)[1])
        return data

    def drop(self, offset: int) -> None:
        self._bytes -= len(self._data.pop(offset, b""))


def _messages(topics: Mapping[int, BagTopic], data: bytes, starts: Iterable[int]) -> Iterator[BagMessage]:
    unpack, size = MESSAGE.unpack_from, MESSAGE.size
    for start in starts:
        _, length, channel, sequence, log_time_ns, publish_time_ns = unpack(data, start)
        content = data[start + size : start + 9 + length]
        yield BagMessage(topics[channel], content, log_time_ns, publish_time_ns, sequence)
