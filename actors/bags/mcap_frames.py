"""The records of an MCAP file: where they are, within limits.

Every length that the file states is compared with what is there, and with a limit, before memory is taken.
The contents of records are parsed by the library (`mcap`), except for those that a file has by the million:
messages, chunks and the indexes of chunks. Its readers take four times the CPU time for a message of 256
bytes (7.3 µs next to 1.7 µs), and know neither the limits of here nor the place of what is wrong.
"""

from __future__ import annotations

import os
import struct
import zlib
from io import BytesIO
from typing import TYPE_CHECKING, Final, NamedTuple, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from actors.bags.compression import CompressionError, decompress
from actors.bags.errors import InvalidBagError
from actors.bags.files import MAX_MESSAGE_BYTES, open_regular

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path
    from typing import NoReturn

MAGIC: Final = b"\x89MCAP0\r\n"
MAX_RECORD_BYTES: Final = 16 * 1024 * 1024
"""A record other than a chunk, a message or an attachment."""
HEAD: Final = struct.Struct("<BQ")
"""Before each record: its kind, and the length of its content."""
MESSAGE: Final = struct.Struct("<BQHIQQ")
"""Head, channel, sequence, log time and publish time of a message."""
_CHUNK: Final = struct.Struct("<QQQII")
_LONG: Final = struct.Struct("<Q")
_LARGE: Final = frozenset({Opcode.CHUNK, Opcode.MESSAGE, Opcode.ATTACHMENT})
_MALFORMED: Final = (McapError, struct.error, UnicodeDecodeError, ValueError, MemoryError)
"""What the library raises for a record that is none."""

T = TypeVar("T")


class _Stream(ReadDataStream):
    """The bytes of one record; a length beyond its end is an error, and not cut."""

    def read(self, length: int) -> bytes:
        data = super().read(length)
        if len(data) != length:
            raise ValueError("a length is beyond the end of the record")
        return data


class Record(NamedTuple):
    """A record of a file."""

    opcode: int
    start: int
    """Where its content begins."""
    length: int

    @property
    def end(self) -> int:
        """Where the next one begins."""
        return self.start + self.length


class FileEndsError(InvalidBagError):
    """The file ends before what it states to have."""


class McapFrames:
    """An MCAP file that is open, and its records.

    Args:
        path: The file.
        max_chunk_bytes: The most bytes of a chunk after decompression, and of a message.

    Attributes:
        path: The file.
        size: Its bytes.

    Raises:
        InvalidBagError: It is no MCAP file. All methods raise it, with the place of what they cannot read.
    """

    def __init__(self, path: Path, *, max_chunk_bytes: int = MAX_MESSAGE_BYTES) -> None:
        self.path = path
        self.max_chunk_bytes = max_chunk_bytes
        self._file = open_regular(path)
        self.size = os.fstat(self._file.fileno()).st_size
        try:
            if self._file.read(len(MAGIC)) != MAGIC:
                self.fail(0, "this is no MCAP file: its first bytes are others")
        except BaseException:
            self._file.close()
            raise

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def fail(self, offset: int, reason: str) -> NoReturn:
        """Raise InvalidBagError for a place."""
        raise InvalidBagError(self.path, f"byte {offset:,}", reason)

    def _cut(self, offset: int, reason: str) -> FileEndsError:
        return FileEndsError(self.path, f"byte {offset:,}", reason)

    def bytes_at(self, offset: int, length: int) -> bytes:
        """Return bytes of the file."""
        self._file.seek(offset)
        data = self._file.read(length)
        if len(data) != length:
            raise self._cut(offset, f"{length:,} bytes are expected here, and there are {len(data):,}")
        return data

    def record_at(self, offset: int) -> Record:
        """Return the record at a place, whose length is within the file."""
        opcode, length = HEAD.unpack(self.bytes_at(offset, HEAD.size))
        start = offset + HEAD.size
        if length > self.size - start:
            rest = self.size - start
            raise self._cut(offset, f"a record states {length:,} bytes, and the file has {rest:,} more")
        if opcode == 0:
            self.fail(offset, "there is no record here: its kind is 0")
        if opcode <= Opcode.DATA_END and opcode not in _LARGE and length > MAX_RECORD_BYTES:
            self.fail(offset, f"a record states {length:,} bytes; at most {MAX_RECORD_BYTES:,} are read")
        return Record(opcode, start, length)

    def parsed(self, read: Callable[[ReadDataStream], T], data: bytes, offset: int) -> T:
        """Return a record of the library's."""
        try:
            return read(_Stream(BytesIO(data)))
        except _MALFORMED as error:
            self.fail(offset, f"a record cannot be read: {str(error) or type(error).__name__}")

    def content(self, record: Record) -> bytes:
        """Return the content of a record."""
        return self.bytes_at(record.start, record.length)

    def message_head(self, record: Record) -> tuple[int, int]:
        """Return a message's channel and log time."""
        if record.length + HEAD.size < MESSAGE.size:
            self.fail(record.start, "a message is too short")
        head = self.bytes_at(record.start - HEAD.size, MESSAGE.size)
        _, _, channel, _, log_time_ns, _ = MESSAGE.unpack(head)
        return channel, log_time_ns

    def chunk_data(self, offset: int) -> bytes:
        """Return the records of a chunk, decompressed, with their checksum verified."""
        record = self.record_at(offset)
        if record.opcode != Opcode.CHUNK or record.length < _CHUNK.size:
            self.fail(offset, "there is no chunk here")
        head = self.bytes_at(record.start, _CHUNK.size)
        _, _, size, crc, name_length = _CHUNK.unpack(head)
        rest = record.length - _CHUNK.size - _LONG.size - name_length
        if rest < 0 or name_length > MAX_RECORD_BYTES:
            self.fail(offset, "the head of a chunk is cut")
        tail = self.bytes_at(record.start + _CHUNK.size, name_length + _LONG.size)
        name = tail[:name_length].decode(errors="replace")
        (stored,) = _LONG.unpack_from(tail, name_length)
        if stored != rest:
            self.fail(offset, f"a chunk states {stored:,} bytes, and has {rest:,}")
        if size > self.max_chunk_bytes or stored > self.max_chunk_bytes:
            largest = max(size, stored)
            self.fail(offset, f"a chunk states {largest:,} bytes; at most {self.max_chunk_bytes:,} are read")
        if not name and size != stored:
            self.fail(offset, f"a chunk without compression states {size:,} bytes, and has {stored:,}")
        try:
            data = decompress(name, self.bytes_at(record.end - stored, stored), size)
        except CompressionError as error:
            self.fail(offset, f"a chunk cannot be read: {error}")
        if len(data) != size:
            self.fail(offset, f"a chunk states {size:,} bytes, and has {len(data):,}")
        if crc and zlib.crc32(data) != crc:
            self.fail(offset, "a chunk has another checksum than it states: its bytes were changed")
        return data

    def records(self, offset: int, end: int) -> Iterator[Record]:
        """Yield the records between two places."""
        while offset < end:
            record = self.record_at(offset)
            yield record
            offset = record.end
