"""How messages between brokers are encoded (docs/mesh.md specifies it).

Frames have the encoding that they have between nodes and brokers. What else belongs to a message is in its
attachment: big-endian numbers.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection, Iterator, Mapping
from struct import Struct
from typing import Annotated, Final, TypeAlias, TypeVar

import msgspec

from broker.mesh.messages import Change, Direct, Heartbeat, Held, Snapshot
from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.codec import Decoder, encode

_version: Final = Struct(">Q")
_numbers: Final = Struct(">QQQ")
_ask: Final = Struct(">QQ")
ASK_BYTES: Final = _ask.size
"""The size of a request for a snapshot."""

_T = TypeVar("_T")
_Number: TypeAlias = Annotated[int, msgspec.Meta(ge=0)]


_Text: TypeAlias = Annotated[str, msgspec.Meta(max_length=63)]


MAX_DECLARATIONS: Final = 1_000_000
"""Declarations in one snapshot: more than `--max-mesh-endpoints` lets one broker have, and few megabytes."""


class _Snapshot(msgspec.Struct):
    """The payload of a snapshot: a map."""

    epoch: _Number
    version: _Number
    declarations: msgspec.Raw
    name: _Text = ""
    software: _Text = ""
    sourced: bool = False


_heartbeats: Final = msgspec.msgpack.Decoder(
    tuple[_Number, dict[_Number, tuple[_Number, _Number]], dict[_Number, Held]]
)
_snapshots: Final = msgspec.msgpack.Decoder(_Snapshot)

_DECLARATIONS: Final = (frames.Node, frames.Publisher, frames.Subscription, frames.Service, frames.Client)
_CHANGES: Final = (*_DECLARATIONS, frames.Retire, frames.Undeclare)


def encode_change(change: Change) -> tuple[bytes, bytes]:
    """Return the payload and the attachment of a change."""
    return encode(change.frame), _version.pack(change.version)


def encode_direct(direct: Direct) -> tuple[bytes, bytes]:
    """Return the payload and the attachment of a direct message."""
    return encode(direct.frame), _numbers.pack(direct.epoch, direct.number, direct.endpoint)


def encode_heartbeat(heartbeat: Heartbeat) -> bytes:
    """Return the payload of a heartbeat."""
    return msgspec.msgpack.encode((heartbeat.version, heartbeat.sent, dict(heartbeat.held)))


def decode_heartbeat(payload: bytes) -> Heartbeat:
    """Return a heartbeat.

    Raises:
        ProtocolError: It is malformed.
    """
    return Heartbeat(*_structure(_heartbeats, payload))


def encode_ask(broker: int, epoch: int) -> bytes:
    """Return the payload of a request for a snapshot."""
    return _ask.pack(broker, epoch)


def decode_ask(payload: bytes) -> tuple[int, int]:
    """Return the broker that asks, and the epoch; zeros for a program that is no broker and sends nothing.

    Raises:
        ProtocolError: It is malformed.
    """
    broker, epoch = _unpack(_ask, payload) if payload else (0, 0)
    return broker, epoch


class SnapshotEncoder:
    """Encodes snapshots; the declarations of the last one are kept, as many brokers may ask for the same."""

    def __init__(self) -> None:
        self._last: Collection[frames.Frame] = ()
        self._encoded = msgspec.Raw(b"\x90")

    def encode(self, snapshot: Snapshot) -> bytes:
        """Return the payload of a snapshot."""
        if snapshot.declarations is not self._last:
            self._last = snapshot.declarations
            self._encoded = msgspec.Raw(msgspec.msgpack.encode([encode(each) for each in self._last]))
        return msgspec.msgpack.encode(
            _Snapshot(
                snapshot.epoch,
                snapshot.version,
                self._encoded,
                snapshot.name,
                snapshot.software,
                snapshot.sourced,
            )
        )


def encode_snapshot(snapshot: Snapshot) -> bytes:
    """Return the payload of a snapshot."""
    return SnapshotEncoder().encode(snapshot)


_ARRAYS: Final = {0xDC: 2, 0xDD: 4}
_BINS: Final = {0xC4: 1, 0xC5: 2, 0xC6: 4}
"""By the first byte of an array or a bin, the bytes that have its length."""


class _Declarations(Collection["frames.Frame"]):
    """Declarations that are decoded whenever they are iterated over: in slices, and without being kept.

    They are not even split before: that takes 0.1 s for a million, and memory for each.

    Args:
        encoded: A complete value of msgpack.
        decode: Decodes one of them.

    Raises:
        ProtocolError: It is no array, or has too many elements.
    """

    def __init__(self, encoded: msgspec.Raw, decode: Callable[[bytes], frames.Frame]) -> None:
        self._encoded, self._decode = memoryview(encoded), decode
        first = self._encoded[0]
        if first & 0xF0 == 0x90:
            self._length, self._start = first & 0x0F, 1
        else:
            self._start, self._length = self._read_length(0, _ARRAYS, "the declarations are no array")
        if self._length > MAX_DECLARATIONS:
            raise _malformed(f"it has {self._length} declarations, more than {MAX_DECLARATIONS}")

    def __len__(self) -> int:
        return self._length

    def __iter__(self) -> Iterator[frames.Frame]:
        encoded, decode, end = self._encoded, self._decode, self._start
        for _ in range(self._length):
            begin, length = self._read_length(end, _BINS, "a declaration is no bin")
            end = begin + length
            yield decode(bytes(encoded[begin:end]))

    def _read_length(self, at: int, sizes: Mapping[int, int], error: str) -> tuple[int, int]:
        """Return where the content of an array or bin begins, and its length."""
        size = sizes.get(self._encoded[at])
        if size is None:
            raise _malformed(error)
        begin = at + 1 + size
        return begin, int.from_bytes(self._encoded[at + 1 : begin])

    def __contains__(self, item: object) -> bool:
        return any(each == item for each in self)


class MessageDecoder:
    """Decodes what has frames in it. Not thread-safe: each engine has its own.

    Its methods raise ProtocolError for what is malformed.
    """

    def __init__(self) -> None:
        self._frame = Decoder().decode

    def change(self, payload: bytes, attachment: bytes) -> Change:
        """Return a change."""
        (version,) = _unpack(_version, attachment)
        frame = self._frame(payload)
        if not isinstance(frame, _CHANGES):
            raise _malformed(f"{type(frame).__name__} does not change a graph")
        return Change(version, frame)

    def direct(self, broker: int, payload: bytes, attachment: bytes) -> Direct:
        """Return a direct message to a broker."""
        epoch, number, endpoint = _unpack(_numbers, attachment)
        return Direct(broker, epoch, number, endpoint, self._frame(payload))

    def published(self, payload: bytes) -> frames.Batch | frames.Assert:
        """Return what a publisher sends to all subscriptions of its topic."""
        frame = self._frame(payload)
        if not isinstance(frame, (frames.Batch, frames.Assert)):
            raise _malformed(f"{type(frame).__name__} does not carry a topic's message")
        return frame

    def snapshot(self, payload: bytes) -> Snapshot:
        """Return a snapshot."""
        snapshot = self.lazy_snapshot(payload)
        return snapshot._replace(declarations=tuple(snapshot.declarations), size=0)

    def lazy_snapshot(self, payload: bytes) -> Snapshot:
        """Return a snapshot whose declarations are decoded later, one after the other.

        Iterating over them raises ProtocolError at one that is malformed.
        """
        fields = _structure(_snapshots, payload)
        return Snapshot(
            fields.epoch,
            fields.version,
            _Declarations(fields.declarations, self._declaration),
            fields.name,
            fields.software,
            fields.sourced,
            len(payload),
        )

    def _declaration(self, raw: bytes) -> frames.Frame:
        frame = self._frame(raw)
        if not isinstance(frame, _DECLARATIONS):
            raise _malformed(f"{type(frame).__name__} is not a declaration")
        return frame


def _structure(decoder: msgspec.msgpack.Decoder[_T], payload: bytes) -> _T:
    try:
        return decoder.decode(payload)
    except msgspec.MsgspecError as error:
        raise _malformed(str(error)) from None
    except UnicodeDecodeError:  # msgspec raises it, and RecursionError, beside its own errors
        raise _malformed("a string is not UTF-8") from None
    except RecursionError:
        raise _malformed("it is nested too deeply") from None


def _unpack(shape: Struct, attachment: bytes) -> tuple[int, ...]:
    try:
        return shape.unpack(attachment)
    except struct.error:
        raise _malformed(f"an attachment has {len(attachment)} bytes instead of {shape.size}") from None


def _malformed(text: str) -> ProtocolError:
    return ProtocolError(ErrorCode.MALFORMED, text)
