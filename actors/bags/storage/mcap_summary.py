"""Summarizes an MCAP file, from the index at its end, or else by a scan up to the last whole record."""

from __future__ import annotations

import heapq
import struct
from array import array
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from itertools import pairwise, starmap
from operator import le
from typing import TYPE_CHECKING, Final, NamedTuple

from mcap.opcode import Opcode
from mcap.records import Channel, Footer, Metadata, MetadataIndex, Schema, Statistics

from actors.bags.contents.qos_lists import qos_profiles
from actors.bags.contents.records import BagTopic
from actors.bags.errors import InvalidBagError
from actors.bags.storage.mcap_frames import HEAD, MAGIC, MESSAGE, FileEndsError
from actors.interfaces.definition_texts import full_type_name
from actors.interfaces.yaml_reader import YamlError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from actors.bags.storage.bag_file import Filter
    from actors.bags.storage.mcap_frames import McapFrames, Record

MAX_DEFINITIONS_BYTES: Final = 256 * 1024 * 1024
"""Limit for all schemas, channels and Metadata records of a file together."""
MAX_INDEX_BYTES: Final = 512 * 1024 * 1024
"""Limit for the chunk indexes of a file: those of about 500,000 chunks."""
SORTED_AT_ONCE: Final = 1_000_000
"""Messages that are sorted by time as numbers of Python, some 100 bytes of each."""
ENDS_EARLY: Final = "its end is missing: its recorder was killed, or the file was truncated"
_INDEXED: Final = frozenset(
    {Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS, Opcode.CHUNK_INDEX, Opcode.METADATA_INDEX}
)
"""Records of the summary section that are read."""
_CHUNK_INDEX: Final = struct.Struct("<QQQQI")
_INDEX_OFFSET: Final = struct.Struct("<HQ")
_FOOTER_BYTES: Final = 20
_END_BYTES: Final = HEAD.size + _FOOTER_BYTES + len(MAGIC)


class ChunkPlace(NamedTuple):
    """Offset, times and channels of a chunk."""

    start_ns: int
    end_ns: int
    offset: int
    channels: bytes | None
    """The ids of its channels, with the offsets of their message indexes; None if unknown."""

    def has_any(self, numbers: set[int]) -> bool:
        """Return whether it may have messages of one of these channels."""
        if self.channels is None:
            return True
        return any(channel in numbers for channel, _ in _INDEX_OFFSET.iter_unpack(self.channels))


class Entries(NamedTuple):
    """The messages of a chunk, as parallel arrays: log times, offsets of their records, and channels."""

    times: array[int]
    starts: array[int]
    channels: array[int]

    @classmethod
    def empty(cls) -> Entries:
        """Return no entries."""
        return cls(array("Q"), array("Q"), array("H"))

    def chosen(self, numbers: set[int], chosen: Filter) -> Entries:
        """Return the entries of some channels that match a filter."""
        if chosen.start_ns is None and chosen.end_ns is None and numbers.issuperset(self.channels):
            return self
        return self._at(
            index
            for index, (log_time_ns, channel) in enumerate(zip(self.times, self.channels, strict=True))
            if channel in numbers and chosen.overlaps(log_time_ns, log_time_ns)
        )

    def by_time(self) -> Entries:
        """Return the entries ordered by log time."""
        if all(starmap(le, pairwise(self.times))):
            return self
        return self._at(indexes_by_time(self.times))

    def _at(self, indexes: Iterable[int]) -> Entries:
        found = Entries.empty()
        for index in indexes:
            for values, all_values in zip(found, self, strict=True):
                values.append(all_values[index])
        return found


def indexes_by_time(times: array[int]) -> Iterable[int]:
    """Return the places of times in their order; equal ones as they are.

    They are sorted in parts: a chunk can have millions, and Python's numbers take ten times their memory.

    Args:
        times: The times.
    """
    key, count = times.__getitem__, len(times)
    parts = [
        array("Q", sorted(range(start, min(start + SORTED_AT_ONCE, count)), key=key))
        for start in range(0, count, SORTED_AT_ONCE)
    ]
    return parts[0] if len(parts) == 1 else heapq.merge(*parts, key=key)


@dataclass
class Summary:
    """Topics, counts, chunks and metadata of a file."""

    topics: dict[int, BagTopic] = field(default_factory=dict[int, BagTopic])
    counts: defaultdict[int, int] = field(default_factory=lambda: defaultdict(int))
    chunks: list[ChunkPlace] = field(default_factory=list[ChunkPlace])
    start_ns: int = 0
    end_ns: int = 0
    metadata: dict[str, Mapping[str, str]] = field(default_factory=dict[str, "Mapping[str, str]"])
    end: int = 0
    """Offset of the end of the last whole record."""
    problem: str = ""
    statistics: Statistics | None = None
    index_bytes: int = 0

    def note(self, start_ns: int, end_ns: int, counts: Mapping[int, int]) -> None:
        """Count messages between two times."""
        first = not self.counts
        self.start_ns = start_ns if first else min(self.start_ns, start_ns)
        self.end_ns = end_ns if first else max(self.end_ns, end_ns)
        for channel, count in counts.items():
            self.counts[channel] += count


class _MissingSchemaError(InvalidBagError):
    """A channel refers to a schema that has not been read."""


class SummaryReader:
    """Reads the summary of a file.

    Args:
        frames: The file.
    """

    def __init__(self, frames: McapFrames) -> None:
        self._frames = frames
        self._schemas: dict[int, Schema] = {}
        self._kept_bytes = 0

    def read(self) -> Summary:
        """Return the summary of the file: from its index, or from a scan of the whole file.

        Raises:
            InvalidBagError: Its first record cannot be read.
        """
        problem = ""
        try:
            summary = self._indexed()
        except _MissingSchemaError:
            summary = None  # an index may leave out schemas, which is not damage: scan the file
        except InvalidBagError as error:
            summary, problem = None, f"its index is damaged: {error.reason}"
        if summary is None:
            self._schemas.clear()
            self._kept_bytes = 0
            summary = self._scanned()
            summary.problem = summary.problem or problem
        return summary

    def _has_end(self) -> bool:
        return self._frames.bytes_at(self._frames.size - len(MAGIC), len(MAGIC)) == MAGIC

    def _indexed(self) -> Summary | None:
        """Return the summary from the index; None if the file has none, or an incomplete one."""
        place = self._frames.size - _END_BYTES
        if place < len(MAGIC) or not self._has_end():
            return None
        record = self._frames.record_at(place)
        if record.opcode != Opcode.FOOTER or record.length != _FOOTER_BYTES:
            return None
        footer = self._frames.parsed(Footer.read, self._frames.content(record), place)
        if not footer.summary_start:
            return None
        if not len(MAGIC) <= footer.summary_start <= place:
            start = footer.summary_start
            self._frames.fail(place, f"the summary would be at byte {start:,}, outside of the file")
        summary = Summary(end=footer.summary_start)
        for record in self._frames.records(footer.summary_start, place):
            self._index(record, summary)
        statistics = summary.statistics
        if statistics is None or (statistics.message_count and not summary.chunks):
            return None
        summary.counts.update(statistics.channel_message_counts)
        unknown = summary.counts.keys() - summary.topics.keys()
        if unknown or sum(summary.counts.values()) != statistics.message_count:
            # Channels or counts may be left out of the summary: then only the chunks tell.
            return None
        summary.start_ns, summary.end_ns = statistics.message_start_time, statistics.message_end_time
        return summary

    def _index(self, record: Record, summary: Summary) -> None:
        """Add a record of the summary section."""
        if record.opcode not in _INDEXED:  # not needed, and perhaps huge: its content is not read
            return
        content = self._frames.content(record)
        match record.opcode:
            case Opcode.SCHEMA:
                self._add_schema(content, record.start)
            case Opcode.CHANNEL:
                self._add_channel(content, record.start, summary)
            case Opcode.STATISTICS:
                summary.statistics = self._frames.parsed(Statistics.read, content, record.start)
            case Opcode.CHUNK_INDEX:
                summary.index_bytes += record.length
                if summary.index_bytes > MAX_INDEX_BYTES:
                    self._frames.fail(record.start, f"the index exceeds {MAX_INDEX_BYTES:,} bytes")
                summary.chunks.append(self._chunk_place(content, record.start))
            case Opcode.METADATA_INDEX:
                self._add_metadata(content, record.start, summary)
            case _:
                pass

    def _chunk_place(self, data: bytes, offset: int) -> ChunkPlace:
        if len(data) < _CHUNK_INDEX.size:
            self._frames.fail(offset, "the index of a chunk is too short")
        start_ns, end_ns, place, _, length = _CHUNK_INDEX.unpack_from(data)
        if length > len(data) - _CHUNK_INDEX.size or length % _INDEX_OFFSET.size:
            self._frames.fail(offset, "the index of a chunk is truncated")
        if not len(MAGIC) <= place < self._frames.size:
            self._frames.fail(offset, f"a chunk would be at byte {place:,}, outside of the file")
        return ChunkPlace(start_ns, end_ns, place, data[_CHUNK_INDEX.size : _CHUNK_INDEX.size + length])

    def _add_metadata(self, data: bytes, offset: int, summary: Summary) -> None:
        index = self._frames.parsed(MetadataIndex.read, data, offset)
        if not len(MAGIC) <= index.offset < self._frames.size - HEAD.size:
            self._frames.fail(offset, f"metadata would be at byte {index.offset:,}, outside of the file")
        record = self._frames.record_at(index.offset)
        if record.opcode == Opcode.METADATA:
            self._keep_metadata(record, summary)

    def _keep_metadata(self, record: Record, summary: Summary) -> None:
        self._keep(record.length, record.start)
        metadata = self._frames.parsed(Metadata.read, self._frames.content(record), record.start)
        summary.metadata[metadata.name] = metadata.metadata

    def salvage(self) -> tuple[Summary, list[str]]:
        """Read all chunks; return a summary of the whole ones, and the damages, each in one sentence."""
        index: Summary | None = None
        problems: list[str] = []
        try:
            index = self._indexed()
        except InvalidBagError as error:
            problems.append(f"its index is damaged: {error.reason}")
        summary = self._scanned(problems, {} if index is None else index.topics)
        if summary.problem:
            problems.append(summary.problem)
        # The scan stops at a record with a wrong length; the index knows the chunks behind it.
        for place in () if index is None else index.chunks:
            if place.offset >= summary.end:
                try:
                    self._scan(self._frames.record_at(place.offset), summary)
                except InvalidBagError as error:
                    problems.append(f"{error.place}: {error.reason}")
        return summary, problems

    def _scanned(
        self, problems: list[str] | None = None, topics: dict[int, BagTopic] | None = None
    ) -> Summary:
        """Return the summary of all records up to the first one that is not whole.

        Args:
            problems: Collects damaged records, after which the scan continues; None to stop at the first.
            topics: Topics that are known already, by channel.
        """
        summary = Summary(end=len(MAGIC), topics=dict(topics or {}))
        try:
            for record in self._frames.records(len(MAGIC), self._frames.size):
                if record.opcode == Opcode.DATA_END:
                    if not self._has_end():
                        summary.problem = "its index is truncated; all messages are there"
                    return summary
                try:
                    self._scan(record, summary)
                except InvalidBagError as error:
                    if problems is None:
                        raise
                    problems.append(f"{error.place}: {error.reason}")
                summary.end = record.end
            reason = ENDS_EARLY
        except FileEndsError:
            reason = ENDS_EARLY
        except InvalidBagError as error:
            reason = error.reason
        rest = self._frames.size - summary.end
        summary.problem = f"{reason}; the last {rest:,} bytes cannot be read"
        return summary

    def _scan(self, record: Record, summary: Summary) -> None:
        match record.opcode:
            case Opcode.SCHEMA:
                self._add_schema(self._frames.content(record), record.start)
            case Opcode.CHANNEL:
                self._add_channel(self._frames.content(record), record.start, summary)
            case Opcode.METADATA:
                self._keep_metadata(record, summary)
            case Opcode.MESSAGE:
                channel, log_time_ns = self._frames.message_head(record)
                if channel not in summary.topics:
                    self._frames.fail(
                        record.start, f"a message refers to channel {channel}, which is missing"
                    )
                summary.note(log_time_ns, log_time_ns, {channel: 1})
            case Opcode.CHUNK:
                offset = record.start - HEAD.size
                data = self._frames.chunk_data(offset)
                entries = self.entries(data, offset, summary)
                if entries.times:
                    start_ns, end_ns = min(entries.times), max(entries.times)
                    summary.chunks.append(ChunkPlace(start_ns, end_ns, offset, None))
                    summary.note(start_ns, end_ns, Counter(entries.channels))
            case _:
                pass

    def _keep(self, length: int, offset: int) -> None:
        self._kept_bytes += length
        if self._kept_bytes > MAX_DEFINITIONS_BYTES:
            self._frames.fail(
                offset, f"schemas, channels and metadata exceed {MAX_DEFINITIONS_BYTES:,} bytes"
            )

    def _add_schema(self, data: bytes, offset: int) -> None:
        schema = self._frames.parsed(Schema.read, data, offset)
        if schema.id not in self._schemas:
            self._keep(len(data), offset)
            self._schemas[schema.id] = schema

    def _add_channel(self, data: bytes, offset: int, summary: Summary) -> None:
        channel = self._frames.parsed(Channel.read, data, offset)
        if channel.id in summary.topics:
            return
        self._keep(len(data), offset)
        schema = self._schemas.get(channel.schema_id)
        if schema is None and channel.schema_id:
            raise _MissingSchemaError(
                self._frames.path,
                f"byte {offset:,}",
                f"topic {channel.topic[:80]!r} refers to schema {channel.schema_id}, which is missing",
            )
        try:
            profiles = qos_profiles(channel.metadata.get("offered_qos_profiles"))
        except YamlError:
            profiles = ()  # the messages can be read without them
        summary.topics[channel.id] = BagTopic(
            name=channel.topic,
            type_name="" if schema is None else full_type_name(schema.name),
            # Invalid UTF-8 makes a definition that cannot be parsed, which is reported with its topic.
            definition="" if schema is None else schema.data.decode(errors="replace"),
            definition_format="" if schema is None else schema.encoding,
            type_hash=channel.metadata.get("topic_type_hash", ""),
            qos_profiles=profiles,
            encoding=channel.message_encoding,
        )

    def entries(self, data: bytes, offset: int, summary: Summary) -> Entries:
        """Return the messages of a chunk in their order, and add its schemas and channels to the summary.

        Args:
            data: The decompressed records of the chunk.
            offset: The offset of the chunk in the file, for errors.
            summary: The summary of the file.
        """
        entries = Entries.empty()
        times, starts, channels = entries
        position, size, head_size = 0, len(data), HEAD.size
        unpack_head, unpack_message = HEAD.unpack_from, MESSAGE.unpack_from
        while position < size:
            if size - position < head_size:
                self._frames.fail(offset, "the last record of a chunk is truncated")
            opcode, length = unpack_head(data, position)
            start, position = position, position + head_size + length
            if position > size:
                self._frames.fail(offset, f"a record announces {length:,} bytes, more than its chunk has")
            if opcode == Opcode.MESSAGE:
                if position - start < MESSAGE.size:
                    self._frames.fail(offset, "a message is too short")
                _, _, channel, _, log_time_ns, _ = unpack_message(data, start)
                times.append(log_time_ns)
                starts.append(start)
                channels.append(channel)
            elif opcode == Opcode.SCHEMA:
                self._add_schema(data[start + head_size : position], offset)
            elif opcode == Opcode.CHANNEL:
                self._add_channel(data[start + head_size : position], offset, summary)
        if unknown := set(channels) - summary.topics.keys():
            self._frames.fail(offset, f"messages refer to channel {min(unknown)}, which is missing")
        return entries
