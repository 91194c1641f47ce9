"""Carries the messages of a mesh over Zenoh (docs/mesh.md specifies the keys).

Zenoh calls back in its own threads, and its `put` may block. So received samples wait in a deque, and one
wake-up of the event loop handles a burst of them; what is to be sent is put by a thread, from a bounded queue.
"""

from __future__ import annotations

import json
import logging
import queue
import threading
from collections import deque
from struct import Struct
from typing import TYPE_CHECKING, Any, Final, Protocol

from broker.mesh.messages import Change, Direct, Message, Publish, Snapshot, Subscribe
from proto import frames
from proto.codec import Decoder, encode
from proto.errors import ProtocolError
from proto.limits import MAX_DOMAIN

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable

    import zenoh

    from broker.mesh.mesh import Mesh

logger: Final = logging.getLogger("callboard.broker")

PREFIX: Final = "callboard/1"
MAX_QUEUED_BYTES: Final = 16 * 1024 * 1024
"""Bytes that wait for the thread; more wait in the outbox, which drops what QoS allows to drop."""

_number: Final = Struct(">Q")


class Host(Protocol):
    """The broker: handles what has arrived in its event loop."""

    def mesh(self, domain: int) -> Mesh:
        """Return the mesh of a domain, in which this broker takes part from now on."""
        ...

    def flush(self) -> None:
        """Send what the router has returned."""
        ...


class ZenohEngine:
    """One broker's Zenoh session.

    Args:
        number: The broker's number.
        loop: Its event loop.
        host: Handles what arrives.
    """

    def __init__(self, number: int, loop: asyncio.AbstractEventLoop, host: Host) -> None:
        self._number = number
        self._id = f"{number:08x}"
        self._loop = loop
        self._host = host
        self._session: zenoh.Session | None = None
        self._received: deque[tuple[Callable[..., None], tuple[Any, ...]]] = deque()
        self._scheduled = False
        self._to_send: queue.SimpleQueue[tuple[str, Any, bytes | None] | None] = queue.SimpleQueue()
        self._queued_bytes = 0
        self._was_full = False
        self._thread: threading.Thread | None = None
        self._declared: list[Any] = []
        self._topics: dict[tuple[int, str], Any] = {}
        self._asked: set[tuple[int, int]] = set()
        self._decoder = Decoder()

    # Life

    def open(self, config: zenoh.Config) -> None:
        """Open the session; blocks."""
        import zenoh  # noqa: PLC0415 - an extra

        self._session = zenoh.open(config)
        self._thread = threading.Thread(target=self._send_queued, name="mesh", daemon=True)
        self._thread.start()
        self._declared.append(
            self._session.liveliness().declare_subscriber(f"{PREFIX}/*/alive/*", self._token, history=True)
        )

    def _token(self, sample: zenoh.Sample) -> None:
        domain = str(sample.key_expr).split("/")[2]
        if domain.isdecimal() and int(domain) <= MAX_DOMAIN:
            self._wake(self._alive, int(domain), sample)

    def close(self) -> None:
        """Close it; blocks."""
        self._to_send.put(None)
        if self._thread is not None:
            self._thread.join(5)
        if self._session is not None:
            self._session.close()

    def join(self, domain: int) -> None:
        """Take part in the graph of a domain."""
        session = self._session
        assert session is not None
        base, mine = f"{PREFIX}/{domain}", f"{PREFIX}/{domain}/brokers/{self._id}"
        self._declared += [
            session.declare_subscriber(f"{base}/brokers/*/changes", self._on(domain, self._changed)),
            session.declare_subscriber(f"{mine}/frames/*", self._on(domain, self._direct)),
            session.declare_queryable(f"{mine}/graph", lambda query: self._wake(self._answer, domain, query)),
            session.liveliness().declare_token(f"{base}/alive/{self._id}"),
        ]

    def _on(self, domain: int, handler: Callable[..., None]) -> Callable[[zenoh.Sample], None]:
        def received(sample: zenoh.Sample) -> None:
            self._wake(handler, domain, sample)

        return received

    # Sending

    @property
    def full(self) -> bool:
        """Whether so much waits for the thread that the outbox should keep the rest."""
        self._was_full = self._queued_bytes > MAX_QUEUED_BYTES
        return self._was_full

    def send(self, domain: int, messages: list[Message]) -> None:
        """Send messages in order."""
        base = f"{PREFIX}/{domain}"
        for message in messages:
            if isinstance(message, Publish):
                self._put(f"{base}/topics{message.topic}", message.raw, None)
            elif isinstance(message, Direct):
                key = f"{base}/brokers/{message.broker:08x}/frames/{self._id}"
                self._put(key, encode(message.frame), _number.pack(message.endpoint))
            elif isinstance(message, Change):
                key = f"{base}/brokers/{self._id}/changes"
                self._put(key, encode(message.frame), _number.pack(message.version))
            else:
                self._subscribe(domain, message)

    def _put(self, key: str, payload: Any, attachment: bytes | None) -> None:
        self._queued_bytes += len(payload)
        self._to_send.put((key, payload, attachment))

    def _send_queued(self) -> None:
        import zenoh  # noqa: PLC0415 - an extra

        assert self._session is not None
        publishers: dict[str, zenoh.Publisher] = {}
        while (item := self._to_send.get()) is not None:
            key, payload, attachment = item
            publisher = publishers.get(key)
            if publisher is None:
                publisher = publishers[key] = self._session.declare_publisher(
                    key, congestion_control=zenoh.CongestionControl.BLOCK, express=False
                )
            publisher.put(bytes(payload), attachment=attachment)
            self._queued_bytes -= len(payload)
            if self._was_full and self._queued_bytes < MAX_QUEUED_BYTES // 2:
                self._was_full = False
                self._loop.call_soon_threadsafe(self._host.flush)

    def _subscribe(self, domain: int, message: Subscribe) -> None:
        assert self._session is not None
        if message.wanted:
            self._topics[domain, message.topic] = self._session.declare_subscriber(
                f"{PREFIX}/{domain}/topics{message.topic}", self._on(domain, self._published)
            )
        else:
            self._topics.pop((domain, message.topic)).undeclare()

    # Receiving

    def _wake(self, handler: Callable[..., None], *arguments: Any) -> None:
        """Handle something in the event loop; called in Zenoh's threads."""
        self._received.append((handler, arguments))
        if not self._scheduled:
            self._scheduled = True
            self._loop.call_soon_threadsafe(self._handle_received)

    def _handle_received(self) -> None:
        self._scheduled = False
        for _ in range(len(self._received)):
            handler, (domain, item) = self._received.popleft()
            try:
                handler(self._host.mesh(domain), domain, item)
            except ProtocolError as error:
                logger.warning("The mesh has sent something invalid: %s", error)
        self._host.flush()

    def _published(self, mesh: Mesh, _domain: int, sample: zenoh.Sample) -> None:
        mesh.receiver.published(self._decoder.decode(sample.payload.to_bytes()))

    def _direct(self, mesh: Mesh, _domain: int, sample: zenoh.Sample) -> None:
        sender = int(str(sample.key_expr).rpartition("/")[2], 16)
        (endpoint,) = _number.unpack(sample.attachment.to_bytes())
        mesh.receiver.received(
            sender, Direct(self._number, self._decoder.decode(sample.payload.to_bytes()), endpoint)
        )

    def _changed(self, mesh: Mesh, domain: int, sample: zenoh.Sample) -> None:
        sender = int(str(sample.key_expr).split("/")[4], 16)
        if sender == self._number:
            return
        (version,) = _number.unpack(sample.attachment.to_bytes())
        if not mesh.take_change(sender, Change(version, self._decoder.decode(sample.payload.to_bytes()))):
            self._ask(domain, sender)

    def _alive(self, mesh: Mesh, domain: int, sample: zenoh.Sample) -> None:
        import zenoh  # noqa: PLC0415 - an extra

        broker = int(str(sample.key_expr).rpartition("/")[2], 16)
        if broker == self._number:
            return
        if sample.kind == zenoh.SampleKind.PUT:
            self._ask(domain, broker)
        else:
            mesh.remove_broker(broker)

    def _ask(self, domain: int, broker: int) -> None:
        """Request a broker's snapshot."""
        if (domain, broker) in self._asked:
            return
        self._asked.add((domain, broker))
        assert self._session is not None

        def replied(reply: zenoh.Reply) -> None:
            self._wake(self._answered, domain, (broker, reply))

        self._session.get(f"{PREFIX}/{domain}/brokers/{broker:08x}/graph", replied, timeout=5)

    def _answer(self, mesh: Mesh, domain: int, query: zenoh.Query) -> None:
        snapshot = mesh.snapshot()
        payload = b"".join(encode(frame) for frame in snapshot.declarations)
        key = f"{PREFIX}/{domain}/brokers/{self._id}/graph"
        query.reply(key, payload, attachment=_number.pack(snapshot.version))
        query.drop()

    def _answered(self, mesh: Mesh, domain: int, item: tuple[int, zenoh.Reply]) -> None:
        broker, reply = item
        self._asked.discard((domain, broker))
        if reply.ok is None:
            return
        content = reply.ok.payload.to_bytes()
        declarations: list[frames.Frame] = []
        start = 0
        while start < len(content):
            size = 5 + int.from_bytes(content[start + 1 : start + 5], "big")
            declarations.append(self._decoder.decode(content[start : start + size]))
            start += size
        (version,) = _number.unpack(reply.ok.attachment.to_bytes())
        mesh.take_snapshot(broker, Snapshot(version, tuple(declarations)))


def config_for(listen: str | None, connect: str | None) -> zenoh.Config:
    """Return the configuration of a session in router mode, without scouting."""
    import zenoh  # noqa: PLC0415 - an extra

    config = zenoh.Config()
    config.insert_json5("mode", '"router"')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("scouting/gossip/enabled", "false")
    config.insert_json5("listen/endpoints", json.dumps([listen] if listen else []))
    config.insert_json5("connect/endpoints", json.dumps([connect] if connect else []))
    return config
