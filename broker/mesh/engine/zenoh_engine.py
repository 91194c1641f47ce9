"""Carries the messages of a mesh over Zenoh (docs/mesh.md specifies the keys)."""

from __future__ import annotations

import asyncio
import logging
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import zenoh

from broker.errors import ListenError
from broker.mesh import wire
from broker.mesh.broker_session import MAX_BROKERS, SMALL_BYTES
from broker.mesh.engine.engine import EngineStats, Traffic
from broker.mesh.engine.neighbours import watch
from broker.mesh.engine.received_queue import MAX_NUMBERED_BYTES, MAX_RECEIVED_BYTES, ReceivedQueue
from broker.mesh.engine.sending_thread import SendingThread
from broker.mesh.engine.zenoh_config import connect_endpoints, plain_text
from broker.mesh.messages import Ask, Change, Direct, Heartbeat, Publish
from proto.aio.tasks import cancel_and_wait, keep_running
from proto.errors import ErrorCode, ProtocolError
from proto.limits import MAX_DOMAIN
from proto.untrusted_text import escape
from proto.wire.mesh_keys import broker_id, broker_of_key, zenoh_id

if TYPE_CHECKING:
    from collections.abc import Generator

    from broker.mesh.engine.engine import Host
    from broker.mesh.mesh import Mesh
    from broker.mesh.messages import Message
    from proto.aio.read_budget import ReadBudget

logger: Final = logging.getLogger("callboard.broker")

VERSION: Final = "1"
"""Version of the keys and of the encoding of messages; brokers with other versions do not see each other."""

MAX_OTHERS: Final = 100
"""Brokers with other versions that are remembered, so that each is logged once."""

PREFIX: Final = f"callboard/{VERSION}"

MAX_QUERIES: Final = 1000
"""Requests for snapshots that wait for the event loop: one of each broker. Further ones get no answer, and
are repeated. Nor do those with more than a request."""

ASK_TIMEOUT_SEC: Final = 5.0
"""How long Zenoh waits for a snapshot; after that, the broker is asked again."""

ASK_AGAIN_SEC: Final = 0.1
"""Pause before a broker is asked again. One that has just joined can often not be reached yet, because Zenoh
does not know a route to it."""


class ZenohEngine:
    """One broker's Zenoh session (`engine.Engine`).

    Args:
        number: The broker's number.
        host: Handles what arrives.
        budget: The read budget of the broker's event loop.
        config: The configuration of the session.
    """

    def __init__(self, number: int, host: Host, budget: ReadBudget, config: zenoh.Config) -> None:
        self._number = number
        self._id = broker_id(number)
        self._host = host
        self._config = config
        config.insert_json5("id", f'"{zenoh_id(number)}"')  # pyright: ignore[reportUnknownMemberType]
        self._loop = asyncio.get_running_loop()
        self._received = ReceivedQueue(self._loop, budget, host)
        warn = partial(host.warn, "messages that could not be sent", "Mesh: could not send to %s: %s")
        in_loop = self._received.in_loop
        self._sending = SendingThread(
            lambda: in_loop(host.flush), lambda key, reason: in_loop(partial(warn, key, reason))
        )
        self._decode = wire.MessageDecoder()
        self._snapshots = wire.SnapshotEncoder()
        self._declared: list[Any] = []
        """Subscribers, queryables and tokens. Zenoh undeclares them when they are collected, so they are
        kept."""
        self._topics: dict[tuple[int, str], zenoh.Subscriber[None]] = {}
        self._traffic: dict[int, Traffic] = {}
        self._of_other_versions: set[str] = set()
        self._queries = 0
        """Requests for snapshots that wait for the event loop."""
        self._open = False
        self._endpoints = connect_endpoints(config)
        self._watch: asyncio.Task[None] | None = None

    # Engine

    async def start(self) -> None:
        """Open the session. It connects and reconnects in the background."""
        # Zenoh's own log, if RUST_LOG asks for it.
        zenoh.try_init_log_from_env()  # type: ignore[no-untyped-call]
        try:
            self._session = await asyncio.to_thread(zenoh.open, self._config)
        except zenoh.ZError as error:
            raise ListenError(f"Cannot join the mesh: {plain_text(error)}") from None
        self._open = True
        self._source = zenoh.SourceInfo(self._session.id, 0)
        self._sending.start(self._session, self._source)
        # `history`: brokers that joined before this one are reported, too.
        tokens = self._session.liveliness().declare_subscriber(
            "callboard/*/*/alive/*",
            self._received.callback(self._on_token, 0, MAX_NUMBERED_BYTES),
            history=True,
        )
        self._declared.append(tokens)
        if self._endpoints:
            watching = keep_running("The mesh's watch", lambda: watch(self._neighbours, self._endpoints))
            self._watch = self._loop.create_task(watching)

    def _neighbours(self) -> list[str]:
        info = self._session.info
        return [str(each) for each in (*info.routers_zid(), *info.peers_zid())]

    def join(self, domain: int) -> None:
        """Take part in the graph of a domain."""
        session, base, calling = self._session, f"{PREFIX}/{domain}", self._received.callback
        mine = f"{base}/brokers/{self._id}"
        keys = {
            f"{base}/brokers/*/changes": self._on_change,
            f"{base}/brokers/*/heartbeat": self._on_heartbeat,
            f"{mine}/frames/*": self._on_direct,
        }
        self._declared += [
            *(
                session.declare_subscriber(key, calling(handler, domain, MAX_NUMBERED_BYTES))
                for key, handler in keys.items()
            ),
            session.declare_queryable(f"{mine}/graph", self._query_callback(domain)),
            # Last: others ask for the graph as soon as they see the token.
            session.liveliness().declare_token(f"{base}/alive/{self._id}"),
        ]

    @property
    def full(self) -> bool:
        """Whether it accepts no more messages now, so that the outbox keeps the rest."""
        return self._sending.full

    def send(self, domain: int, messages: list[Message]) -> None:
        """Send messages in order."""
        base, put = f"{PREFIX}/{domain}", self._sending.put
        for message in messages:
            if isinstance(message, Publish):
                put(f"{base}/topics{message.topic}", message.raw)
            elif isinstance(message, Direct):
                payload, attachment = wire.encode_direct(message)
                put(f"{base}/brokers/{broker_id(message.broker)}/frames/{self._id}", payload, attachment)
                traffic = self._traffic.get(message.broker)
                if traffic is not None:
                    traffic.sent += 1
                    traffic.bytes_sent += len(payload)
            elif isinstance(message, Change):
                payload, attachment = wire.encode_change(message)
                put(f"{base}/brokers/{self._id}/changes", payload, attachment)
            elif isinstance(message, Heartbeat):
                put(f"{base}/brokers/{self._id}/heartbeat", wire.encode_heartbeat(message))
            elif isinstance(message, Ask):
                self._ask(domain, message)
            elif message.wanted:
                handler = partial(self._on_message, message.topic)
                self._topics[domain, message.topic] = self._session.declare_subscriber(
                    f"{base}/topics{message.topic}",
                    self._received.callback(handler, domain, MAX_RECEIVED_BYTES),
                )
            else:
                self._topics.pop((domain, message.topic)).undeclare()  # type: ignore[no-untyped-call]

    def statistics(self) -> EngineStats:
        """Return its numbers."""
        sending, received = self._sending, self._received
        neighbours: tuple[str, ...] = ()
        if self._open:
            neighbours = tuple(self._neighbours())
        return EngineStats(
            traffic=self._traffic,
            sent=sending.sent,
            bytes_sent=sending.bytes_sent,
            sending_bytes=sending.waiting_bytes,
            unhandled_bytes=received.waiting_bytes,
            overruns=received.dropped,
            failed=sending.failed,
            malformed=received.malformed,
            neighbours=neighbours,
        )

    async def stop(self) -> None:
        """Send the messages that wait, and close the session."""
        self._open = False
        if self._watch is not None:
            await cancel_and_wait(self._watch)
        self._received.close()
        await asyncio.to_thread(self._close)

    def _close(self) -> None:
        self._sending.stop()
        self._session.close()  # type: ignore[no-untyped-call]

    # Receiving

    def _on_token(self, _domain: int, sample: zenoh.Sample) -> None:
        _, version, domain_name, _, sender = str(sample.key_expr).split("/")
        if version != VERSION:
            others = self._of_other_versions
            if sender not in others and len(others) < MAX_OTHERS:
                others.add(sender)
                text = "Mesh: the broker %.20s speaks version %.20s of the mesh, this one %s: %s"
                logger.warning(text, escape(sender), escape(version), VERSION, "update the older one")
            return
        domain, broker = int(domain_name), int(sender, 16)
        if not 0 <= domain <= MAX_DOMAIN:
            raise ValueError(f"there is no domain {domain}")
        if broker == self._number:
            return
        mesh = self._host.mesh(domain)
        if sample.kind == zenoh.SampleKind.PUT:
            if len(self._traffic) < MAX_BROKERS:
                self._traffic.setdefault(broker, Traffic())
            mesh.add_broker(broker)
        else:
            self._traffic.pop(broker, None)
            mesh.remove_broker(broker)

    def _on_change(self, domain: int, sample: zenoh.Sample) -> None:
        broker = _sender(sample, 4)
        if broker != self._number:
            with self._from(domain, broker, sample) as mesh:
                if mesh.sessions.admits(broker, len(sample.payload)):
                    mesh.receive(
                        broker, self._decode.change(self._payload(broker, sample), _attachment(sample))
                    )

    def _on_heartbeat(self, domain: int, sample: zenoh.Sample) -> None:
        broker = _sender(sample, 4)
        if broker != self._number:
            with self._from(domain, broker, sample) as mesh:
                mesh.accept_heartbeat(broker, wire.decode_heartbeat(self._payload(broker, sample)))

    def _on_direct(self, domain: int, sample: zenoh.Sample) -> None:
        broker = _sender(sample, 6)
        with self._from(domain, broker, sample) as mesh:
            if not mesh.sessions.admits(broker, len(sample.payload)):  # not even copied
                return
            payload, attachment = self._payload(broker, sample), _attachment(sample)
            mesh.receive(broker, self._decode.direct(self._number, payload, attachment))

    def _on_message(self, topic: str, domain: int, sample: zenoh.Sample) -> None:
        payload = sample.payload.to_bytes()
        frame = self._decode.published(payload)
        broker = broker_of_key(frame.publisher)
        mesh = self._host.mesh(domain)
        _check_source(mesh, broker, sample.source_info)
        self._count(broker, payload)
        mesh.receive(broker, frame, topic)

    def _payload(self, broker: int, sample: zenoh.Sample) -> bytes:
        payload = sample.payload.to_bytes()
        self._count(broker, payload)
        return payload

    def _count(self, broker: int, payload: bytes) -> None:
        traffic = self._traffic.get(broker)
        if traffic is not None:
            traffic.received += 1
            traffic.bytes_received += len(payload)

    @contextmanager
    def _from(self, domain: int, broker: int, sample: zenoh.Sample) -> Generator[Mesh]:
        """Reject a broker whose message cannot be decoded, if it is certainly its own."""
        mesh, source = self._host.mesh(domain), sample.source_info
        _check_source(mesh, broker, source)
        try:
            yield mesh
        except ProtocolError as error:
            if source is None:
                raise
            mesh.reject(broker, str(error))

    # Snapshots

    def _ask(self, domain: int, ask: Ask) -> None:
        """Request a broker's snapshot."""
        broker = ask.broker
        key = f"{PREFIX}/{domain}/brokers/{broker_id(broker)}/graph"
        payload = wire.encode_ask(self._number, ask.epoch)
        received, replied = self._received, partial(self._received.put, self._on_reply, domain)
        source, answered = zenoh_id(broker), False

        def reply(item: zenoh.Reply) -> None:
            # Anybody may answer under a broker's key; the session that has is certain.
            nonlocal answered
            replier = item.replier_id
            if not answered and replier is not None and str(replier.zid) == source:
                answered = True
                size = 0 if item.ok is None else len(item.ok.payload)
                has_space = size <= SMALL_BYTES or received.has_space(size)
                replied((broker, item if has_space else None), size=size)

        def end() -> None:
            if not answered:
                replied((broker, None))

        handler = zenoh.handlers.Callback(reply, end, indirect=False)
        self._session.get(
            key,
            handler,
            payload=payload,
            timeout=ASK_TIMEOUT_SEC,
            # All that are there: another queryable under its key must not keep a broker from answering.
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            source_info=self._source,
        )

    def _on_reply(self, domain: int, item: tuple[int, zenoh.Reply | None]) -> None:
        broker, reply = item
        mesh = self._host.mesh(domain)
        if reply is None or reply.ok is None:

            def ask_again(_domain: int, number: int) -> None:
                mesh.accept_snapshot(number, None)

            self._loop.call_later(ASK_AGAIN_SEC, self._received.put, ask_again, domain, broker)
        else:
            try:
                mesh.accept_snapshot(broker, self._decode.lazy_snapshot(reply.ok.payload.to_bytes()))
            except ProtocolError as error:
                mesh.reject(broker, str(error))
            if broker in mesh.sessions:
                self._traffic.setdefault(broker, Traffic())

    def _query_callback(self, domain: int) -> zenoh.handlers.Callback[zenoh.Query]:
        """Return what lets the event loop answer requests for the snapshot, unless too many wait for it."""

        def received(query: zenoh.Query) -> None:
            size = 0 if query.payload is None else len(query.payload)
            if self._queries < MAX_QUERIES and size <= wire.ASK_BYTES:
                self._queries += 1  # approximate: Zenoh's threads, and the loop, which subtracts
                self._received.put(self._on_query, domain, query)
            else:
                query.drop()  # type: ignore[no-untyped-call]

        return zenoh.handlers.Callback(received, indirect=False)

    def _on_query(self, domain: int, query: zenoh.Query) -> None:
        self._queries = max(0, self._queries - 1)
        asked = b"" if query.payload is None else query.payload.to_bytes()
        broker, epoch = wire.decode_ask(asked)
        mesh, source = self._host.mesh(domain), query.source_info
        if broker:  # its epoch may reset the session with that broker
            _check_source(mesh, broker, source)
        if mesh.admits_query(0 if source is None else broker):
            key = f"{PREFIX}/{domain}/brokers/{self._id}/graph"
            payload = self._snapshots.encode(mesh.snapshot(broker, epoch))
            query.reply(key, payload)  # pyright: ignore[reportUnknownMemberType]
        query.drop()  # type: ignore[no-untyped-call]


def _check_source(mesh: Mesh, broker: int, source: zenoh.SourceInfo | None) -> None:
    """Raise ProtocolError if a sample or query in a broker's number is another session's.

    Programs need not name a source: what they send is taken, but no reason to reject the broker.
    """
    if source is None:
        if mesh.sessions.is_sourced(broker):
            raise ProtocolError(ErrorCode.UNEXPECTED, f"a message of {broker_id(broker)} without a source")
    elif str(source.source_id.zid) != zenoh_id(broker):
        raise ProtocolError(ErrorCode.UNEXPECTED, f"a message of {broker_id(broker)} from another session")


def _sender(sample: zenoh.Sample, part: int) -> int:
    return int(str(sample.key_expr).split("/")[part], 16)


def _attachment(sample: zenoh.Sample) -> bytes:
    return b"" if sample.attachment is None else sample.attachment.to_bytes()
