"""The encoding of messages between brokers."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from broker.mesh import wire
from broker.mesh.messages import Change, Direct, Heartbeat, Held, Snapshot
from proto.errors import ProtocolError
from proto.limits import MAX_U64
from proto.wire import frames
from proto.wire.codec import encode
from tests.broker import frame_makers as make

if TYPE_CHECKING:
    from collections.abc import Callable

DECODER = wire.MessageDecoder()
NODE = frames.Node(1, "/talker")


def snapshot_of(declarations: object) -> bytes:
    """Return a snapshot with any declarations."""
    return msgspec.msgpack.encode({"epoch": 1, "version": 1, "declarations": declarations})


def test_messages_are_decoded_as_they_were() -> None:
    """Each kind of message survives its encoding, with the largest numbers."""
    change = Change(MAX_U64, frames.Undeclare(1))
    assert DECODER.change(*wire.encode_change(change)) == change
    direct = Direct(2, MAX_U64, MAX_U64, MAX_U64, frames.Grant(1, 2, 3, 4))
    assert DECODER.direct(2, *wire.encode_direct(direct)) == direct
    heartbeat = Heartbeat(MAX_U64, {7: (MAX_U64, 0)}, {3: Held(MAX_U64, (1, 2)), 4: Held(0)})
    assert wire.decode_heartbeat(wire.encode_heartbeat(heartbeat)) == heartbeat
    snapshot = Snapshot(1, 2, (NODE, make.publisher(2, node=1)))
    assert DECODER.snapshot(wire.encode_snapshot(snapshot)) == snapshot
    assert wire.decode_ask(wire.encode_ask(5, MAX_U64)) == (5, MAX_U64)
    assert wire.decode_ask(b"") == (0, 0)


@pytest.mark.parametrize(
    ("decode", "payload"),
    [
        (DECODER.published, encode(frames.Ping(1))),
        (lambda payload: DECODER.change(payload, bytes(8)), encode(frames.Grant(1, 2, 3, 4))),
        (lambda payload: DECODER.change(payload, bytes(7)), encode(NODE)),
        (lambda payload: DECODER.direct(1, payload, b""), encode(NODE)),
        (DECODER.snapshot, wire.encode_heartbeat(Heartbeat(1, {}))),
        (DECODER.snapshot, wire.encode_snapshot(Snapshot(0, 0, (frames.Ping(1),)))),
        (DECODER.snapshot, snapshot_of(3)),
        (DECODER.snapshot, snapshot_of([encode(NODE), "text"])),
        (DECODER.snapshot, snapshot_of([b""] * (wire.MAX_DECLARATIONS + 1))),
        (DECODER.snapshot, wire.encode_snapshot(Snapshot(0, 0, (), "nnnn")).replace(b"nnnn", b"\xff" * 4)),
        (DECODER.snapshot, b"\x81\xa1x" + b"\x91" * 5000 + b"\xc0"),
        (wire.decode_ask, bytes(15)),
    ],
    ids=[
        "topic",
        "change",
        "version",
        "numbers",
        "snapshot",
        "declaration",
        "no-array",
        "no-bin",
        "too-many",
        "text",
        "nested",
        "request",
    ],
)
def test_messages_of_another_kind_are_refused(decode: Callable[[bytes], object], payload: bytes) -> None:
    """A frame that does not belong there, an attachment of another size, invalid UTF-8, a deep field."""
    with pytest.raises(ProtocolError):
        decode(payload)


@pytest.mark.parametrize("count", [0, 15, 16, 65_536])
@pytest.mark.parametrize("name", ["/n", "/" + "n" * 250])
def test_declarations_are_decoded_when_they_are_needed(count: int, name: str) -> None:
    """Case 66: until then a snapshot takes no more than its bytes, however many it has."""
    node = frames.Node(1, name)
    payload = snapshot_of([encode(node)] * count)
    snapshot = DECODER.lazy_snapshot(payload)
    assert (snapshot.size, len(snapshot.declarations)) == (len(payload), count)
    first = next(iter(snapshot.declarations), None)
    assert first == (node if count else None)
    assert sum(1 for _ in snapshot.declarations) == count


def test_a_malformed_declaration_is_found_when_it_is_reached() -> None:
    """Case 66: those before it are decoded."""
    declarations = iter(DECODER.lazy_snapshot(snapshot_of([encode(NODE), b"\xc0"])).declarations)
    assert next(declarations) == NODE
    with pytest.raises(ProtocolError):
        next(declarations)


@given(st.binary(max_size=60), st.binary(max_size=30))
def test_any_bytes_are_decoded_or_refused(payload: bytes, attachment: bytes) -> None:
    """Nothing but ProtocolError is raised."""
    for decode in (
        lambda: DECODER.change(payload, attachment),
        lambda: DECODER.direct(1, payload, attachment),
        lambda: DECODER.published(payload),
        lambda: wire.decode_heartbeat(payload),
        lambda: DECODER.snapshot(payload),
        lambda: wire.decode_ask(payload),
    ):
        with suppress(ProtocolError):
            decode()
