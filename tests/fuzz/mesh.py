"""The mesh: other brokers that send any messages raise nothing, and leave the router's tables consistent.

An input that begins with the byte 255 also has samples as Zenoh hands them over: payloads and attachments of
any bytes, most of them encoded messages in which some bytes have been changed.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from broker.mesh import wire
from broker.mesh.messages import Change, Direct, Heartbeat, Held, Snapshot
from proto import limits
from proto.errors import ProtocolError
from proto.wire import frames
from proto.wire.codec import decode, encode
from proto.wire.frames import SPECS
from proto.wire.mesh_keys import broker_of_key
from tests.broker import frame_makers as make
from tests.broker.mesh.network import MeshBroker
from tests.fuzz.router import VALUES, check_tables, number
from tests.fuzz.source import Source
from tests.seams.brokers import calls_between_brokers, endpoint_keys, imports_of, remote_endpoints

DECODER = wire.MessageDecoder()

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from broker.mesh.broker_session import BrokerSession
    from broker.mesh.mesh import Mesh

MAX_STEPS: Final = 200
HERE: Final = 1
BROKERS: Final = (2, 3)
DECLARATIONS: Final = (frames.Node, frames.Publisher, frames.Subscription, frames.Service, frames.Client)
GOOD: Final = (
    frames.Node(1, "/a"),
    make.publisher(2, "/a", node=1),
    make.subscription(3, "/a", node=1),
    make.client(4, "/a", node=1),
    make.service(5, "/a", node=1),
)
DIRECT: Final = (
    frames.Attached,
    frames.Replay,
    frames.Grant,
    frames.Request,
    frames.Reply,
    frames.Cancel,
    frames.Describe,
    frames.Definition,
    frames.Ping,
    frames.Pong,
)
ANY: Final[Mapping[str, Callable[[Source], Any]]] = {
    **VALUES,
    "u32s": lambda source: (number(source) % 12, number(source) % 12),
}
KINDS: Final = {spec.frame: spec.kinds for spec in SPECS.values()}


def check(data: bytes) -> None:
    """Let other brokers, and a node of this one, do what the bytes say."""
    samples = data.startswith(b"\xff")
    source = Source(data[1:] if samples else data)
    broker = MeshBroker(1, max_endpoints=8)
    node = broker.join("/a")
    broker.send(node, make.subscription(1, "/a"), make.service(2, "/a"), make.client(3, "/a"))
    broker.send(node, make.subscription(4, "/a", qos=make.KEEP_ALL))
    broker.send(node, make.publisher(5, "/a", qos=make.LATCHED))
    for _ in range(MAX_STEPS):
        if source.ended:
            break
        if samples and source.below(2):
            _receive(broker.mesh, BROKERS[source.below(len(BROKERS))], source)
        else:
            step(broker, node, source)
        check_tables(broker)
    for other in BROKERS:
        broker.mesh.remove_broker(other)
    broker.forward()
    broker.mesh.pop_messages()
    assert {key >> 32 for key in endpoint_keys(broker.router)} == {1}
    assert remote_endpoints(broker.mesh) == calls_between_brokers(broker.mesh) == 0
    check_tables(broker)


def step(broker: MeshBroker, node: int, source: Source) -> None:
    """Let a broker or the node do one thing; mostly they keep to the rules."""
    mesh, other = broker.mesh, BROKERS[source.below(len(BROKERS))]
    if other not in mesh.sessions.names():
        mesh.remove_broker(other)
        mesh.add_broker(other)
        mesh.snapshot(other, 1)
        mesh.accept_snapshot(other, Snapshot(1, 0, GOOD))
        attached = frames.Attached(other << 32 | 2, (1,), make.GID, 0, "/a", {})
        mesh.receive(other, Direct(1, _session(mesh, other).epoch, 1, 0, attached))
    action = source.below(24)
    if action < 6:
        with suppress(ProtocolError):  # the local node's fault
            broker.send(node, _local(source))
    elif action < 10:
        broker.forward()
        for message in mesh.pop_messages():
            if isinstance(message, Change):
                wire.encode_change(message)
            elif isinstance(message, Direct):
                wire.encode_direct(message)
    elif action < 14:
        _administer(mesh, other, source)
    else:
        _send(mesh, other, source)


def _session(mesh: Mesh, broker: int) -> BrokerSession:
    session = mesh.sessions.get(broker)
    assert session is not None
    return session


def _administer(mesh: Mesh, other: int, source: Source) -> None:
    """Let a broker do what it does rarely."""
    action = source.below(4)
    if action == 0:
        mesh.remove_broker(other)
    elif action == 1:
        declarations = tuple(_declaration(source) for _ in range(source.below(6)))
        snapshot = Snapshot(_epoch(source), number(source), (frames.Node(1, "/a"), *declarations))
        mesh.accept_snapshot(other, DECODER.snapshot(wire.encode_snapshot(snapshot)))
    elif action == 2:
        mesh.accept_heartbeat(other, Heartbeat(number(source), {1: (_epoch(source), number(source))}))
    else:
        mesh.snapshot(other, _epoch(source))


def _send(mesh: Mesh, other: int, source: Source) -> None:
    """Let a broker send one message."""
    action = source.below(3)
    if action == 0:
        version = imports_of(mesh).version(other) + 1 if source.below(8) else number(source)
        kind = (_declaration, _declaration, _undeclare)[source.below(3)]
        mesh.receive(other, Change(version, kind(source)))
    elif action == 1:
        mesh.receive(other, make.batch(_key(source, other), number(source), 1 + source.below(3)))
    else:
        session = _session(mesh, other)
        epoch, received = session.epoch, session.received
        if not source.below(8):
            epoch, received = _epoch(source), number(source)
        mesh.receive(other, Direct(1, epoch, received + 1, source.below(8), _direct(source, other)))


def _receive(mesh: Mesh, other: int, source: Source) -> None:
    """Receive a sample as the engine does: what cannot be decoded rejects its sender."""
    kind = source.below(6)
    payload, attachment = _encoded(mesh, other, kind, source)
    try:
        if kind == 0:
            mesh.receive(other, DECODER.change(payload, attachment))
        elif kind == 1:
            mesh.receive(other, DECODER.direct(HERE, payload, attachment))
        elif kind == 2:
            frame = DECODER.published(payload)
            mesh.receive(broker_of_key(frame.publisher), frame, "/a")
        elif kind == 3:
            mesh.accept_heartbeat(other, wire.decode_heartbeat(payload))
        elif kind == 4:
            mesh.accept_snapshot(other, DECODER.snapshot(payload))
        else:
            wire.encode_snapshot(mesh.snapshot(*wire.decode_ask(payload)))
    except ProtocolError as error:
        assert len(str(error)) <= limits.MAX_ERROR_TEXT  # noqa: PT017 - this is no test
        mesh.reject(other, str(error))


def _encoded(mesh: Mesh, other: int, kind: int, source: Source) -> tuple[bytes, bytes]:
    """Return the payload and the attachment of a sample."""
    session = mesh.sessions.get(other)
    epoch, received = (session.epoch, session.received) if session is not None else (0, 0)
    attachment = b""
    if not source.below(4):
        payload, attachment = source.take(source.below(128)), source.take(source.below(32))
    elif kind == 0:
        version = imports_of(mesh).version(other) + 1
        payload, attachment = wire.encode_change(Change(version, _declaration(source)))
    elif kind == 1:
        direct = Direct(1, epoch, received + 1, source.below(8), _direct(source, other))
        payload, attachment = wire.encode_direct(direct)
    elif kind == 2:
        payload = bytes(make.batch(_key(source, other), number(source), 1 + source.below(3)).raw)
    elif kind == 3:
        held = {source.below(4): Held(number(source), (number(source),)) for _ in range(source.below(3))}
        payload = wire.encode_heartbeat(Heartbeat(number(source), {1: (epoch, number(source))}, held))
    elif kind == 4:
        payload = wire.encode_snapshot(Snapshot(epoch, number(source), GOOD, "b", "1"))
    else:
        payload = wire.encode_ask(other, epoch)
    return _change(payload, source), _change(attachment, source)


def _change(data: bytes, source: Source) -> bytes:
    """Return bytes with up to three of them changed, and sometimes without their end."""
    changed = bytearray(data)
    for _ in range(source.below(4) if changed else 0):
        changed[int.from_bytes(source.take(2), "big") % len(changed)] = source.below(256)
    return bytes(changed if source.below(8) else changed[: source.below(len(changed) + 1)])


def _epoch(source: Source) -> int:
    return number(source) % 2**62


def _key(source: Source, other: int) -> int:
    return (other if source.below(16) else source.below(4)) << 32 | source.below(12)


def _declaration(source: Source) -> Any:
    kind: Any = DECLARATIONS[source.below(len(DECLARATIONS))]
    frame = kind(*(ANY[each](source) for each in KINDS[kind]))
    if source.below(8):
        of_type = {} if kind is frames.Node else {"node": 1, "type_name": make.TYPE, "type_hash": make.HASH}
        frame = frame._replace(id=2 + source.below(10), **of_type)
    return decode(encode(frame))


def _undeclare(source: Source) -> frames.Frame:
    number = source.below(12)
    return frames.Undeclare(number) if source.below(3) else frames.Retire(number)


def _direct(source: Source, other: int) -> Any:
    kind: Any = DIRECT[source.below(len(DIRECT))]
    if not source.below(16):
        return frames.Goodbye("")
    if kind is frames.Replay:
        batch = make.batch(_key(source, other), number(source), 1 + source.below(3))
        return frames.Replay(number(source), *batch[:-1])
    frame = kind(*(ANY[each](source) for each in KINDS[kind]))
    if kind in {frames.Attached, frames.Grant}:
        frame = frame._replace(publisher=_key(source, other))
    if kind is frames.Request:
        frame = frame._replace(endpoint=source.below(12))
    return decode(encode(frame))


def _local(source: Source) -> frames.Frame:
    call = number(source)
    choice = source.below(7)
    if choice == 6:
        return frames.Describe(make.HASH)
    if choice == 0:
        return frames.Cancel(3, (call,))
    if choice == 1:
        return make.reply(2, call)
    if choice == 2:
        return frames.Grant(4, 2 << 32 | call % 12, call, call)
    if choice == 3:
        return frames.Undeclare(1 + source.below(5))
    if choice == 4:
        ends = (make.subscription(1, "/a"), make.service(2, "/a"), make.client(3, "/a"))
        return ends[source.below(3)]
    return frames.Request(3, (frames.RequestEntry(call, None, None, b"q"),))
