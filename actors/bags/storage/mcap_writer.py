"""Writes one MCAP file: chunks with message indexes, then a summary with an index of the chunks.

    magic, Header
    Chunk [Schema, Channel, Message, Message, …], MessageIndex of each channel in it
    Chunk …
    Metadata, DataEnd
    Schemas, Channels, Statistics, ChunkIndexes, MetadataIndexes, SummaryOffsets
    Footer, magic

The library `mcap` builds the records, except for those that a file has by the million: messages, chunks and
message indexes. The library's `Writer` needs four times the CPU time for a message of 256 bytes (6.3 µs
instead of 1.5 µs; `benchmarks/bags.py` compares it with the recorder), and it lacks two things that a
recorder needs: a public way to close a chunk, so that messages older than half a second survive a kill, and a
summary also after a failed write on a full disk. A written chunk can be read whatever happens afterwards,
since schemas and channels are written in the chunk of their first message.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections import defaultdict, deque
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.well_known import Profile

from actors.bags.contents.qos_lists import qos_text
from actors.bags.errors import BagError, BagExistsError, write_error
from actors.bags.storage.compression import compressor

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from mcap.records import McapRecord

    from actors.bags.contents.records import BagTopic

MAGIC: Final = b"\x89MCAP0\r\n"
CHUNK_SIZE: Final = 768 * 1024
"""Size at which a chunk is closed and written, before compression; rosbag2's default."""
MAX_CHANNELS: Final = (1 << 16) - 1
"""Limit for the topics in a file: ids have 16 bits, and 0 is not used."""
MAX_MESSAGE_BYTES: Final = (1 << 32) - 64
"""Limit for a message; the format allows more, but readers do not."""
_LIBRARY: Final = "callboard"
_SPARE_CHUNKS: Final = 16
"""How many of the last chunks may be removed, so that the summary fits on a full disk."""
_LARGE_BYTES: Final = 64 * 1024
"""A chunk whose messages are larger on average is written in pieces: joining them first would only copy."""

_MESSAGE: Final = struct.Struct("<BQHIQQ")
_MESSAGE_BYTES: Final = _MESSAGE.size - 9
_CHUNK: Final = struct.Struct("<BQQQQI")
_INDEX: Final = struct.Struct("<BQHI")
_LENGTH: Final = struct.Struct("<I")
_LONG: Final = struct.Struct("<Q")
_FOOTER_START: Final = struct.Struct("<BQQQ")


class _WrittenChunk(NamedTuple):
    """What is needed to remove a written chunk."""

    start: int
    counts: dict[int, int]


class McapFileWriter:
    """Writes a new MCAP file with the profile `ros2`.

    A failed write raises BagWriteError and leaves only whole chunks in the file; `close` then adds the
    summary, if there is space for it.

    Args:
        path: The file, which must not exist.
        compression: Compression of chunks: "none", "zstd" or "lz4".
        chunk_size: Size in bytes at which a chunk is written.
        fsync: Whether to sync each chunk to the disk before its write returns.

    Attributes:
        counts: Number of written messages, by topic number; those of the open chunk do not count yet.
        lost: Number of messages that could not be written, by topic number.
        start_ns: Least log time of the written messages.
        end_ns: Greatest log time of the written messages.
    """

    def __init__(
        self, path: Path, *, compression: str = "none", chunk_size: int = CHUNK_SIZE, fsync: bool = False
    ) -> None:
        self.path = path
        self._name, self._compress = compressor(compression)
        self._chunk_size = chunk_size
        self._fsync = fsync
        self.counts: defaultdict[int, int] = defaultdict(int)
        self.lost: defaultdict[int, int] = defaultdict(int)
        self.start_ns = self.end_ns = 0
        self._schemas: dict[tuple[str, str, str], Schema] = {}
        self._channels: list[Channel] = []
        self._chunk_indexes: list[bytes] = []
        self._metadata_indexes: list[bytes] = []
        self._written: deque[_WrittenChunk] = deque(maxlen=_SPARE_CHUNKS)
        self._reset_chunk()
        try:
            # Unbuffered: a chunk is a buffer already, and closing must not try to write failed data again.
            self._file = path.open("xb", buffering=0)
        except FileExistsError:
            raise BagExistsError(f"{path} exists") from None
        except OSError as error:
            raise write_error(path, error) from error
        self._position = 0
        self._write(MAGIC, _bytes_of(Header(Profile.ROS2, _LIBRARY)))

    def _reset_chunk(self) -> None:
        self._pieces: list[bytes] = []
        self._chunk_bytes = 0
        self._chunk_start_ns = self._chunk_end_ns = 0
        self._index: dict[int, list[int]] = {}

    @property
    def size(self) -> int:
        """Size of the file in bytes, including the open chunk before compression."""
        return self._position + self._chunk_bytes

    def add_topic(self, topic: BagTopic) -> int:
        """Add a topic; return its number in this file, from 1.

        Args:
            topic: The topic. Adding a topic again adds another channel.

        Raises:
            BagError: The file has `MAX_CHANNELS` topics.
        """
        if len(self._channels) >= MAX_CHANNELS:
            raise BagError(f"{self.path}: a file has at most {MAX_CHANNELS} topics")
        key = (topic.type_name, topic.definition_format, topic.definition)
        schema = self._schemas.get(key)
        if schema is None:
            number = len(self._schemas) + 1
            encoding = topic.definition_format
            schema = Schema(
                id=number, name=topic.type_name, encoding=encoding, data=topic.definition.encode()
            )
            self._schemas[key] = schema
            self._append(_bytes_of(schema))
        channel = Channel(
            id=len(self._channels) + 1,
            topic=topic.name,
            message_encoding=topic.encoding,
            schema_id=schema.id,
            metadata={
                # rosbags finds no messages if this differs from metadata.yaml.
                "offered_qos_profiles": qos_text(topic.qos_profiles),
                "topic_type_hash": topic.type_hash,
            },
        )
        self._channels.append(channel)
        self._append(_bytes_of(channel))
        return channel.id

    def _append(self, record: bytes) -> None:
        self._pieces.append(record)
        self._chunk_bytes += len(record)

    def write(
        self, number: int, data: bytes, log_time_ns: int, publish_time_ns: int, sequence: int = 0
    ) -> None:
        """Write a message.

        Args:
            number: The topic's number.
            data: The message.
            log_time_ns: Time of reception.
            publish_time_ns: Time of publication.
            sequence: The message's number; only its lowest 32 bits are written, as the format has no more.

        Raises:
            BagWriteError: The chunk is full and could not be written.
        """
        index = self._index.get(number)
        if index is None:
            index = self._index[number] = []
            if len(self._index) == 1:
                self._chunk_start_ns = self._chunk_end_ns = log_time_ns
        if log_time_ns > self._chunk_end_ns:
            self._chunk_end_ns = log_time_ns
        elif log_time_ns < self._chunk_start_ns:
            self._chunk_start_ns = log_time_ns
        size = len(data)
        index += (log_time_ns, self._chunk_bytes)
        self._pieces += (
            _MESSAGE.pack(
                Opcode.MESSAGE,
                _MESSAGE_BYTES + size,
                number,
                sequence & 0xFFFFFFFF,
                log_time_ns,
                publish_time_ns,
            ),
            data,
        )
        self._chunk_bytes += _MESSAGE.size + size
        if self._chunk_bytes >= self._chunk_size:
            self.flush()

    def flush(self) -> None:
        """Close the chunk and hand it to the operating system; do nothing if it has no messages.

        Raises:
            BagWriteError: It could not be written. Its messages are counted in `lost`.
        """
        if not self._index:
            return
        pieces, size, index = self._pieces, self._chunk_bytes, self._index
        start_ns, end_ns = self._chunk_start_ns, self._chunk_end_ns
        counts = {number: len(entries) // 2 for number, entries in index.items()}
        self._reset_chunk()
        pieces, crc = self._stored(pieces, size)
        stored = sum(map(len, pieces))
        name = self._name.encode()
        tail = _LENGTH.pack(len(name)) + name + _LONG.pack(stored)
        head = (
            _CHUNK.pack(Opcode.CHUNK, _CHUNK.size - 9 + len(tail) + stored, start_ns, end_ns, size, crc)
            + tail
        )
        start = self._position
        indexes_start = start + len(head) + stored
        records, offsets = _message_indexes(index, indexes_start)
        try:
            self._write(head, *pieces, *records)
        except BaseException:
            for number, count in counts.items():
                self.lost[number] += count
            # Some of them may have been only in the lost chunk: write all of them again in the next one.
            for record in (*self._schemas.values(), *self._channels):
                self._append(_bytes_of(record))
            raise
        self._chunk_indexes.append(
            _bytes_of(
                ChunkIndex(
                    message_start_time=start_ns,
                    message_end_time=end_ns,
                    chunk_start_offset=start,
                    chunk_length=indexes_start - start,
                    message_index_offsets=offsets,
                    message_index_length=sum(map(len, records)),
                    compression=self._name,
                    compressed_size=stored,
                    uncompressed_size=size,
                )
            )
        )
        self._written.append(_WrittenChunk(start, counts))
        first = not self.counts
        self.start_ns = start_ns if first else min(self.start_ns, start_ns)
        self.end_ns = end_ns if first else max(self.end_ns, end_ns)
        for number, count in counts.items():
            self.counts[number] += count

    def _stored(self, pieces: list[bytes], size: int) -> tuple[list[bytes], int]:
        """Return the content of a chunk as it is stored, and the checksum of its uncompressed content."""
        if self._compress is not None or size < _LARGE_BYTES * len(pieces):
            pieces = [b"".join(pieces)]
        crc = 0
        for piece in pieces:
            crc = zlib.crc32(piece, crc)
        return pieces if self._compress is None else [self._compress(pieces[0])], crc

    def add_metadata(self, name: str, items: Mapping[str, str]) -> None:
        """Close the chunk and write a Metadata record.

        Args:
            name: The record's name.
            items: Its strings, by name.

        Raises:
            BagWriteError: The chunk or the record could not be written.
        """
        self.flush()
        start = self._position
        record = _bytes_of(Metadata(name=name, metadata=dict(items)))
        self._write(record)
        self._metadata_indexes.append(_bytes_of(MetadataIndex(offset=start, length=len(record), name=name)))

    def close(self) -> None:
        """Write the open chunk and the summary, and close the file.

        Raises:
            BagWriteError: A part could not be written. The file can be read nevertheless. It has a summary
                unless there was no space even for that.
        """
        if self._file.closed:
            return
        failure: Exception | None = None
        try:
            try:
                self.flush()
            except Exception as error:  # noqa: BLE001 - raised below; the summary comes first
                failure = error
            while True:
                try:
                    self._write(*self._summary())
                    break
                except Exception as error:  # noqa: BLE001 - as above
                    failure = failure or error
                    if not self._give_up_chunk():
                        break
        finally:
            self._file.close()
        if failure is not None:
            raise failure

    def abort(self) -> None:
        """Close the file without writing the open chunk or a summary."""
        self._file.close()

    def _give_up_chunk(self) -> bool:
        """Remove the last chunk to make space for the summary; return False if no chunk may be removed."""
        if not self._written:
            return False
        start, counts = self._written.pop()
        self._chunk_indexes.pop()
        for number, count in counts.items():
            self.counts[number] -= count
            self.lost[number] += count
        self._metadata_indexes.clear()  # metadata come after the last chunk, so they go with it
        self._position = start
        self._cut()
        return True

    def _summary(self) -> list[bytes]:
        """Return the records from DataEnd to the end of the file."""
        counts = {number: count for number, count in self.counts.items() if count}
        statistics = Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=counts,
            chunk_count=len(self._chunk_indexes),
            message_count=sum(counts.values()),
            message_end_time=self.end_ns if counts else 0,
            message_start_time=self.start_ns if counts else 0,
            metadata_count=len(self._metadata_indexes),
            schema_count=len(self._schemas),
        )
        groups: list[tuple[Opcode, list[bytes]]] = [
            (Opcode.SCHEMA, list(map(_bytes_of, self._schemas.values()))),
            (Opcode.CHANNEL, list(map(_bytes_of, self._channels))),
            (Opcode.STATISTICS, [_bytes_of(statistics)]),
            (Opcode.CHUNK_INDEX, self._chunk_indexes),
            (Opcode.METADATA_INDEX, self._metadata_indexes),
        ]
        end = _bytes_of(DataEnd(0))
        start = position = self._position + len(end)
        records: list[bytes] = []
        offsets: list[bytes] = []
        for opcode, group in groups:
            length = sum(map(len, group))
            if group:
                offsets.append(_bytes_of(SummaryOffset(opcode, position, length)))
            records += group
            position += length
        crc = zlib.crc32(b"".join((*records, *offsets)))
        crc = zlib.crc32(_FOOTER_START.pack(Opcode.FOOTER, 20, start, position), crc)
        footer = _bytes_of(Footer(summary_start=start, summary_offset_start=position, summary_crc=crc))
        return [end, b"".join((*records, *offsets)), footer, MAGIC]

    def _write(self, *pieces: bytes) -> None:
        """Append pieces to the file; if that fails, remove the part that was written."""
        try:
            for piece in pieces:
                rest = memoryview(piece)
                while rest:
                    rest = rest[self._file.write(rest) :]
            if self._fsync:
                os.fsync(self._file.fileno())
        except OSError as error:
            self._cut()
            raise write_error(self.path, error) from error
        self._position += sum(map(len, pieces))

    def _cut(self) -> None:
        try:
            self._file.truncate(self._position)
            self._file.seek(self._position)
        except OSError:  # such as after an unmount: the file cannot be reached at all
            pass


def _message_indexes(index: dict[int, list[int]], position: int) -> tuple[list[bytes], dict[int, int]]:
    """Return the message indexes of a chunk, and the file offset of each channel's index.

    Args:
        index: By channel, the times of messages and their offsets in the chunk, in turn.
        position: File offset of the first index.
    """
    records: list[bytes] = []
    offsets: dict[int, int] = {}
    for number, entries in index.items():
        offsets[number] = position
        length = len(entries) * 8
        record = _INDEX.pack(Opcode.MESSAGE_INDEX, 6 + length, number, length)
        records.append(record + struct.pack(f"<{len(entries)}Q", *entries))
        position += len(records[-1])
    return records, offsets


def _bytes_of(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = cast("Any", builder).end()  # untyped
    return data
