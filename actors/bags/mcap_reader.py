"""Reads one MCAP file.

Its messages come by log time, although chunks may overlap: those that are due are merged, and no others are
held.
"""

from __future__ import annotations

import heapq
from array import array
from bisect import bisect_left, bisect_right
from collections import OrderedDict
from typing import TYPE_CHECKING, Final

from mcap.opcode import Opcode

from actors.bags.files import MAX_MESSAGE_BYTES, FileContents, Order
from actors.bags.mcap_frames import HEAD, MAGIC, MESSAGE, McapFrames
from actors.bags.mcap_summary import SummaryReader
from actors.bags.records import BagMessage, TopicCount

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping
    from pathlib import Path

    from actors.bags.files import Filter
    from actors.bags.mcap_summary import ChunkPlace, Entries, Summary
    from actors.bags.records import BagTopic

CACHED_BYTES: Final = 256 * 1024 * 1024
"""Chunks that are kept while their messages are merged: in files in which time goes back."""

MAX_OPEN_MESSAGES: Final = 50_000_000
"""Messages of chunks that overlap, whose times and places are held at once, 20 bytes of each. Compressed, a
few kilobytes can have millions of them."""


class McapFile:
    """An MCAP file that is open for reading: a `BagFile`.

    Args:
        path: The file.
        max_chunk_bytes: The most bytes of a chunk after decompression, and of a message.

    Attributes:
        path: The file.

    Raises:
        InvalidBagError: It is no MCAP file.
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
        """Return what the file has, with the places of its chunks.

        Raises:
            InvalidBagError: Nothing of it can be read.
        """
        if self._summary is None:
            self._summary = self._reader.read()
        return self._summary

    def salvage(self) -> list[str]:
        """Read all chunks, and from now on give the messages of those that are whole.

        Returns:
            What is damaged, each in one sentence.
        """
        self._summary, problems = self._reader.salvage()
        self._summary.problem = ""
        return problems

    def contents(self) -> FileContents:
        """Return what the file has; see `BagFile.contents`."""
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
        """Yield the messages of chunks by log time; those of the same time as they are in the file."""
        # An index that names a chunk twice would be a tie without end.
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
            # As many as come before all others, which in most files are all of the chunk.
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
        """Yield the messages of a file without chunks, such as of rosbag2's preset `fastwrite`."""
        times, offsets = array("Q"), array("Q")
        for record in self._frames.records(len(MAGIC), summary.end):
            if record.opcode == Opcode.MESSAGE:
                channel, log_time_ns = self._frames.message_head(record)
                if channel in numbers and chosen.overlaps(log_time_ns, log_time_ns):
                    times.append(log_time_ns)
                    offsets.append(record.start - HEAD.size)
        by_time = range(len(times))
        for index in by_time if order is Order.FILE else sorted(by_time, key=times.__getitem__):
            record = self._frames.record_at(offsets[index])
            if record.length > self._frames.max_chunk_bytes:
                limit = self._frames.max_chunk_bytes
                self._frames.fail(
                    record.start, f"a message has {record.length:,} bytes; at most {limit:,} are read"
                )
            data = self._frames.bytes_at(offsets[index], HEAD.size + record.length)
            yield from _messages(summary.topics, data, (0,))


class _ChunkCache:
    """The decompressed chunks from which messages are merged; beyond a limit, they are read again."""

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
