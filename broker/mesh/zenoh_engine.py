"""Carries the messages of a mesh over Zenoh (docs/mesh.md specifies the keys).

Zenoh calls back in its network threads, and its `put` may block. So received samples wait in a bounded queue,
which the event loop empties within its read budget; and a thread puts what is to be sent, from another one.
"""

from __future__ import annotations

import asyncio
import logging
import queue
import threading
from collections import deque
from typing import TYPE_CHECKING, Any, Final

import zenoh

from broker.mesh import wire
from broker.mesh.messages import Ask, Change, Direct, Heartbeat, Publish
from proto.aio.read_budget import SHARE_FRAMES, SHARE_SEC
from proto.errors import ProtocolError
from proto.limits import MAX_DOMAIN

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.mesh.engine import Host
    from broker.mesh.messages import Message
    from proto.aio.read_budget import ReadBudget

logger: Final = logging.getLogger("callboard.broker")

PREFIX: Final = "callboard/1"

MAX_QUEUED_BYTES: Final = 16 * 1024 * 1024
"""Bytes that wait for the thread; others wait in the outbox, which drops what QoS allows to drop."""

MAX_RECEIVED_BYTES: Final = 64 * 1024 * 1024
"""Bytes that wait for the event loop. Zenoh, and by that the senders, wait while there are more."""

MAX_BLOCK_SEC: Final = 1.0
"""How long Zenoh waits for the event loop before a message is dropped: it must answer its peers, too."""

ASK_TIMEOUT_SEC: Final = 5.0
ASK_AGAIN_SEC: Final = 1.0

OVERHEAD_BYTES: Final = 200
"""What a queued message takes besides its payload."""


class ZenohEngine:
    """One broker's Zenoh session (`engine.Engine`).

    Args:
        number: The broker's number.
        host: Handles what arrives.
        budget: Of the broker's event loop.
        config: Of the session.

    Attributes:
        dropped: Received messages of topics that had to be dropped because the event loop was too slow.
        failed: Messages that could not be sent.
        malformed: Received messages that could not be decoded.
    """

    def __init__(self, number: int, host: Host, budget: ReadBudget, config: zenoh.Config) -> None:
        self._number = number
        self._id = f"{number:08x}"
        self._host = host
        self._budget = budget
        self._config = config
        self._loop = asyncio.get_running_loop()
        self._closed = False
        self._declared: list[Any] = []
        """What would be undeclared if it were collected."""
        self._topics: dict[tuple[int, str], zenoh.Subscriber[None]] = {}
        self._received: deque[tuple[Callable[..., None], int, Any, int]] = deque()
        self._space = threading.Condition()
        self._received_bytes = 0
        self._scheduled = False
        self._to_send: queue.SimpleQueue[tuple[str, Any, bytes | None] | None] = queue.SimpleQueue()
        self._queued_bytes = self._sent_bytes = 0
        """Bytes that the loop has queued, and that the thread has sent: each has one writer."""
        self._was_full = False
        self._thread = threading.Thread(target=self._send_queued, name="callboard-mesh", daemon=True)
        self.dropped = self.failed = self.malformed = 0

    # Engine

    async def start(self) -> None:
        """Open the session. It connects, and connects again, in the background."""
        self._session = await asyncio.to_thread(zenoh.open, self._config)
        self._thread.start()
        tokens = self._session.liveliness().declare_subscriber(
            f"{PREFIX}/*/alive/*", self._call(self._token, 0), history=True
        )
        self._declared.append(tokens)

    def join(self, domain: int) -> None:
        """Take part in the graph of a domain."""
        session, base = self._session, f"{PREFIX}/{domain}"
        mine = f"{base}/brokers/{self._id}"
        self._declared += [
            session.declare_subscriber(f"{base}/brokers/*/changes", self._call(self._changed, domain)),
            session.declare_subscriber(f"{base}/brokers/*/heartbeat", self._call(self._beaten, domain)),
            session.declare_subscriber(f"{mine}/frames/*", self._call(self._direct, domain)),
            session.declare_queryable(f"{mine}/graph", self._call(self._answer, domain)),
            session.liveliness().declare_token(f"{base}/alive/{self._id}"),
        ]

    @property
    def full(self) -> bool:
        """Whether so much waits for the thread that the outbox should keep the rest."""
        self._was_full = self._queued_bytes - self._sent_bytes > MAX_QUEUED_BYTES
        return self._was_full

    def send(self, domain: int, messages: list[Message]) -> None:
        """Send messages in order."""
        base = f"{PREFIX}/{domain}"
        for message in messages:
            if isinstance(message, Publish):
                self._put(f"{base}/topics{message.topic}", message.raw)
            elif isinstance(message, Direct):
                payload, attachment = wire.encode_direct(message)
                self._put(f"{base}/brokers/{message.broker:08x}/frames/{self._id}", payload, attachment)
            elif isinstance(message, Change):
                payload, attachment = wire.encode_change(message)
                self._put(f"{base}/brokers/{self._id}/changes", payload, attachment)
            elif isinstance(message, Heartbeat):
                self._put(f"{base}/brokers/{self._id}/heartbeat", wire.encode_heartbeat(message))
            elif isinstance(message, Ask):
                self._ask(domain, message)
            elif message.wanted:
                self._topics[domain, message.topic] = self._session.declare_subscriber(
                    f"{base}/topics{message.topic}", self._call(self._published, domain, droppable=True)
                )
            else:
                self._topics.pop((domain, message.topic)).undeclare()  # type: ignore[no-untyped-call]

    async def stop(self) -> None:
        """Send what waits, and close the session."""
        self._closed = True
        with self._space:
            self._space.notify_all()
        self._to_send.put(None)
        await asyncio.to_thread(self._close)

    def _close(self) -> None:
        self._thread.join(ASK_TIMEOUT_SEC)
        self._session.close()  # type: ignore[no-untyped-call]

    # Sending

    def _put(self, key: str, payload: Any, attachment: bytes | None = None) -> None:
        self._queued_bytes += len(payload) + OVERHEAD_BYTES
        self._to_send.put((key, payload, attachment))

    def _send_queued(self) -> None:
        publishers: dict[str, zenoh.Publisher] = {}
        while (item := self._to_send.get()) is not None:
            key, payload, attachment = item
            try:
                publisher = publishers.get(key)
                if publisher is None:
                    publisher = publishers[key] = self._session.declare_publisher(
                        key, congestion_control=zenoh.CongestionControl.BLOCK, express=False
                    )
                publisher.put(bytes(payload), attachment=attachment)  # pyright: ignore[reportUnknownMemberType]
            except zenoh.ZError as error:
                self.failed += 1
                if not self._closed:
                    logger.warning("The mesh could not send to %s: %s", key, error)
            self._sent_bytes += len(payload) + OVERHEAD_BYTES
            if self._was_full and self._queued_bytes - self._sent_bytes < MAX_QUEUED_BYTES // 2:
                self._was_full = False
                self._in_loop(self._host.flush)

    # Receiving

    def _call(
        self, handler: Callable[..., None], domain: int, *, droppable: bool = False
    ) -> zenoh.handlers.Callback[Any]:
        """Return a callback that lets the event loop handle samples, queries and replies.

        It runs in Zenoh's network thread: with a thread for each key, keys would lose their common order.
        """

        def received(item: Any) -> None:
            size = OVERHEAD_BYTES
            if isinstance(item, zenoh.Sample):
                size += len(item.payload)
            with self._space:
                if droppable and self._received_bytes > MAX_RECEIVED_BYTES:
                    self._space.wait_for(self._has_space, MAX_BLOCK_SEC)
                    if not self._has_space():
                        self.dropped += 1
                        return
                self._received_bytes += size
            self._received.append((handler, domain, item, size))
            if not self._scheduled:
                self._scheduled = True
                self._in_loop(self._handle_received)

        return zenoh.handlers.Callback(received, indirect=False)

    def _has_space(self) -> bool:
        return self._closed or self._received_bytes <= MAX_RECEIVED_BYTES

    def _in_loop(self, call: Callable[[], None]) -> None:
        try:
            self._loop.call_soon_threadsafe(call)
        except RuntimeError:  # the loop has been closed without `stop`
            self._closed = True

    def _handle_received(self) -> None:
        if self._budget.exhausted:
            self._budget.wait(self)
        else:
            self.go_on_reading()

    def go_on_reading(self) -> None:
        """Handle a share of what has been received (`read_budget.Reader`)."""
        self._scheduled = False
        if self._closed:
            self._received.clear()
            return
        clock, began, handled = self._budget.clock, self._budget.clock(), 0
        spent = 0.0
        for _ in range(min(len(self._received), SHARE_FRAMES)):
            handler, domain, item, size = self._received.popleft()
            handled += size
            try:
                handler(domain, item)
            except (ProtocolError, ValueError) as error:
                self.malformed += 1
                logger.warning("The mesh has sent something malformed: %s", error)
            spent = clock() - began
            if spent > SHARE_SEC:
                break
        with self._space:
            self._received_bytes -= handled
            self._space.notify_all()
        self._host.flush()
        self._budget.spend(clock() - began)
        if self._received and not self._scheduled:
            self._scheduled = True
            self._budget.wait(self)

    def _token(self, _domain: int, sample: zenoh.Sample) -> None:
        parts = str(sample.key_expr).split("/")
        domain, broker = int(parts[2]), int(parts[4], 16)
        if domain > MAX_DOMAIN:
            raise ValueError(f"there is no domain {domain}")
        if broker == self._number:
            return
        mesh = self._host.mesh(domain)
        if sample.kind == zenoh.SampleKind.PUT:
            mesh.add_broker(broker)
        else:
            mesh.remove_broker(broker)

    def _changed(self, domain: int, sample: zenoh.Sample) -> None:
        broker = _sender(sample, 4)
        if broker != self._number:
            change = wire.decode_change(sample.payload.to_bytes(), _attachment(sample))
            self._host.mesh(domain).receive(broker, change)

    def _beaten(self, domain: int, sample: zenoh.Sample) -> None:
        broker = _sender(sample, 4)
        if broker != self._number:
            heartbeat = wire.decode_heartbeat(sample.payload.to_bytes())
            self._host.mesh(domain).take_heartbeat(broker, heartbeat)

    def _direct(self, domain: int, sample: zenoh.Sample) -> None:
        direct = wire.decode_direct(self._number, sample.payload.to_bytes(), _attachment(sample))
        self._host.mesh(domain).receive(_sender(sample, 6), direct)

    def _published(self, domain: int, sample: zenoh.Sample) -> None:
        frame = wire.decode_published(sample.payload.to_bytes())
        self._host.mesh(domain).receive(frame.publisher >> 32, frame)

    # Snapshots

    def _ask(self, domain: int, ask: Ask) -> None:
        """Request a broker's snapshot."""
        broker = ask.broker
        key = f"{PREFIX}/{domain}/brokers/{broker:08x}/graph"
        payload = wire.encode_ask(self._number, ask.epoch)
        replied = self._call(self._answered, domain)
        answered = False

        def reply(item: zenoh.Reply) -> None:
            nonlocal answered
            answered = True
            replied((broker, item))

        def end() -> None:
            if not answered:
                replied((broker, None))

        handler = zenoh.handlers.Callback(reply, end, indirect=False)
        self._session.get(key, handler, payload=payload, timeout=ASK_TIMEOUT_SEC)

    def _answered(self, domain: int, item: tuple[int, zenoh.Reply | None]) -> None:
        broker, reply = item
        mesh = self._host.mesh(domain)
        if reply is None or reply.ok is None:
            self._loop.call_later(ASK_AGAIN_SEC, mesh.take_snapshot, broker, None)
        else:
            mesh.take_snapshot(broker, wire.decode_snapshot(reply.ok.payload.to_bytes()))

    def _answer(self, domain: int, query: zenoh.Query) -> None:
        asked = b"" if query.payload is None else query.payload.to_bytes()
        snapshot = self._host.mesh(domain).snapshot(*wire.decode_ask(asked))
        key = f"{PREFIX}/{domain}/brokers/{self._id}/graph"
        query.reply(key, wire.encode_snapshot(snapshot))  # pyright: ignore[reportUnknownMemberType]
        query.drop()  # type: ignore[no-untyped-call]


def _sender(sample: zenoh.Sample, part: int) -> int:
    return int(str(sample.key_expr).split("/")[part], 16)


def _attachment(sample: zenoh.Sample) -> bytes:
    return b"" if sample.attachment is None else sample.attachment.to_bytes()
