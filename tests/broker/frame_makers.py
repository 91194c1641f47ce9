"""Frames as clients send them, with what the tests do not care about filled in."""

from __future__ import annotations

from array import array

from proto import limits
from proto.queues.batches import with_raw
from proto.wire import frames
from proto.wire.codec import ARRAY_HEAD_BYTES, array_head
from proto.wire.ends import ends_to_bytes

GID = b"g" * limits.INSTANCE_BYTES
QOS: frames.Options = {"history": 1, "depth": 10, "reliability": 1, "durability": 2}
"""What an empty QoS map means."""
KEEP_ALL: frames.Options = {"history": 2}
LATCHED: frames.Options = {"durability": 1}
TYPE = "std_msgs/msg/String"
HASH = "RIHS01_aa"


def publisher(
    number: int,
    topic: str = "/t",
    *,
    node: int = 0,
    qos: frames.Options | None = None,
    type_hash: str = HASH,
    next_sequence: int = 0,
    live_sequence: int = 0,
) -> frames.Publisher:
    """Return the declaration of a publisher."""
    return frames.Publisher(
        number, node, topic, TYPE, type_hash, qos or {}, GID, next_sequence, None, live_sequence
    )


def subscription(
    number: int,
    topic: str = "/t",
    *,
    node: int = 0,
    qos: frames.Options | None = None,
    raw: bool = False,
    window: int = 100,
    window_bytes: int = 2**30,
) -> frames.Subscription:
    """Return the declaration of a subscription."""
    name, type_hash = (None, None) if raw else (TYPE, HASH)
    return frames.Subscription(number, node, topic, name, type_hash, qos or {}, window, window_bytes)


def service(number: int, name: str = "/s", *, node: int = 0, type_hash: str = HASH) -> frames.Service:
    """Return the declaration of a server."""
    return frames.Service(number, node, name, TYPE, type_hash, None)


def client(number: int, name: str = "/s", *, node: int = 0, type_hash: str = HASH) -> frames.Client:
    """Return the declaration of a client."""
    return frames.Client(number, node, name, TYPE, type_hash)


def batch(publisher_id: int, first: int, length: int = 1, size: int = 10) -> frames.Batch:
    """Return an encoded batch of `length` messages of `size` bytes each."""
    message = b"\xc4" + bytes([size - 2]) + bytes(size - 2) if size < 258 else _long(size)
    ends = ends_to_bytes(array("I", range(size, size * length + 1, size))) if length > 1 else None
    payload = array_head(length) + message * length
    assert len(payload) == ARRAY_HEAD_BYTES + size * length
    return with_raw(frames.Batch(publisher_id, first, 1, length, ends, None, payload, b""))


def _long(size: int) -> bytes:
    return b"\xc6" + (size - 5).to_bytes(4, "big") + bytes(size - 5)


def request(endpoint: int, *calls: int, body: bytes = b"q") -> frames.Request:
    """Return requests with these call ids."""
    return frames.Request(endpoint, tuple(frames.RequestEntry(call, None, None, body) for call in calls))


def fragments(transfer: int, size: int, total: int | None = 16 * 1024 * 1024) -> list[frames.Fragment]:
    """Return fragments that begin, or (without a total) continue, a large message, `size` bytes in all."""
    whole = bytes(100 * 1024)
    pieces = [frames.Fragment(transfer, None, True, whole) for _ in range(size // len(whole))]
    return [pieces[0]._replace(total=total), *pieces[1:]]


def reply(endpoint: int, *calls: int, body: bytes = b"a") -> frames.Reply:
    """Return successful replies to these call ids."""
    entries = tuple(frames.ReplyEntry(call, 0, more=False, attributes=None, body=body) for call in calls)
    return frames.Reply(endpoint, entries)
