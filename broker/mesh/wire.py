"""How messages between brokers are encoded (docs/mesh.md specifies it).

Frames have the encoding that they have between nodes and brokers. What else belongs to a message is in its
attachment: big-endian numbers.
"""

from __future__ import annotations

import struct
from struct import Struct
from typing import Any, Final

import msgpack

from broker.mesh.messages import Change, Direct, Heartbeat, Snapshot
from proto import frames
from proto.codec import Decoder, encode
from proto.errors import ErrorCode, ProtocolError
from proto.limits import MAX_U64

_version: Final = Struct(">Q")
_numbers: Final = Struct(">QQQ")
_ask: Final = Struct(">QQ")
_decoder: Final = Decoder()

_DECLARATIONS: Final = (frames.Node, frames.Publisher, frames.Subscription, frames.Service, frames.Client)
_CHANGES: Final = (*_DECLARATIONS, frames.Undeclare)


def encode_change(change: Change) -> tuple[bytes, bytes]:
    """Return the payload and the attachment of a change."""
    return encode(change.frame), _version.pack(change.version)


def decode_change(payload: bytes, attachment: bytes) -> Change:
    """Return a change.

    Raises:
        ProtocolError: It is malformed.
    """
    (version,) = _unpack(_version, attachment)
    frame = _decoder.decode(payload)
    if not isinstance(frame, _CHANGES):
        raise _malformed(f"{type(frame).__name__} is no change of a graph")
    return Change(version, frame)


def encode_direct(direct: Direct) -> tuple[bytes, bytes]:
    """Return the payload and the attachment of a direct message."""
    return encode(direct.frame), _numbers.pack(direct.epoch, direct.number, direct.endpoint)


def decode_direct(broker: int, payload: bytes, attachment: bytes) -> Direct:
    """Return a direct message to a broker.

    Raises:
        ProtocolError: It is malformed.
    """
    epoch, number, endpoint = _unpack(_numbers, attachment)
    return Direct(broker, epoch, number, endpoint, _decoder.decode(payload))


def decode_published(payload: bytes) -> frames.Batch | frames.Assert:
    """Return what a publisher sends to all subscriptions of its topic.

    Raises:
        ProtocolError: It is malformed.
    """
    frame = _decoder.decode(payload)
    if not isinstance(frame, (frames.Batch, frames.Assert)):
        raise _malformed(f"{type(frame).__name__} is no message of a topic")
    return frame


def encode_heartbeat(heartbeat: Heartbeat) -> bytes:
    """Return the payload of a heartbeat."""
    packed: bytes = msgpack.packb([heartbeat.version, heartbeat.sent])
    return packed


def decode_heartbeat(payload: bytes) -> Heartbeat:
    """Return a heartbeat.

    Raises:
        ProtocolError: It is malformed.
    """
    sent: dict[int, list[int]]
    match _unpackb(payload):
        case [version, dict(sent)] if _are_numbers(version, *sent) and all(map(_is_pair, sent.values())):
            return Heartbeat(version, {broker: (pair[0], pair[1]) for broker, pair in sent.items()})
        case _:
            raise _malformed("a heartbeat is a version and, by broker, an epoch and a number")


def encode_ask(broker: int, epoch: int) -> bytes:
    """Return the payload of a request for a snapshot."""
    return _ask.pack(broker, epoch)


def decode_ask(payload: bytes) -> tuple[int, int]:
    """Return who has asked, and the epoch; zeros for a program that is no broker and sends nothing.

    Raises:
        ProtocolError: It is malformed.
    """
    broker, epoch = _unpack(_ask, payload) if payload else (0, 0)
    return broker, epoch


def encode_snapshot(snapshot: Snapshot) -> bytes:
    """Return the payload of a snapshot."""
    declarations = [encode(frame) for frame in snapshot.declarations]
    fields = {"epoch": snapshot.epoch, "version": snapshot.version, "declarations": declarations}
    packed: bytes = msgpack.packb(fields)
    return packed


def decode_snapshot(payload: bytes) -> Snapshot:
    """Return a snapshot.

    Raises:
        ProtocolError: It is malformed.
    """
    match _unpackb(payload):
        case {"epoch": epoch, "version": version, "declarations": [*encoded]} if _are_numbers(epoch, version):
            return Snapshot(epoch, version, tuple(map(_declaration, encoded)))
        case _:
            raise _malformed("a snapshot is a map with 'epoch', 'version' and 'declarations'")


def _declaration(raw: Any) -> frames.Frame:
    frame = _decoder.decode(raw) if isinstance(raw, bytes) else None
    if not isinstance(frame, _DECLARATIONS):
        raise _malformed("a snapshot has declarations only")
    return frame


def _are_numbers(*values: Any) -> bool:
    return all(type(value) is int and 0 <= value <= MAX_U64 for value in values)


def _is_pair(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and _are_numbers(*value)  # pyright: ignore[reportUnknownArgumentType, reportUnknownVariableType]


def _unpack(shape: Struct, attachment: bytes) -> tuple[int, ...]:
    try:
        return shape.unpack(attachment)
    except struct.error:
        raise _malformed(f"an attachment has {len(attachment)} bytes instead of {shape.size}") from None


def _unpackb(payload: bytes) -> Any:
    try:
        return msgpack.unpackb(payload, strict_map_key=False)
    except (ValueError, msgpack.UnpackException) as error:
        raise _malformed(f"not msgpack: {error}") from None


def _malformed(text: str) -> ProtocolError:
    return ProtocolError(ErrorCode.MALFORMED, text)
