"""The broker: listens, holds the connections, and carries the routers' deliveries to them.

    async with Broker(BrokerOptions(port=0)) as broker:
        print(broker.url)

Nothing here is global: many brokers live in one loop, on any loop. One ticker looks at all clocks.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import secrets
from dataclasses import replace
from itertools import count
from typing import TYPE_CHECKING, Self

from broker.capacity import Capacity
from broker.connection import TICKS_PER_KEEPALIVE, Connection, logger
from broker.drain import Drain
from broker.errors import address_in_use_error, listen_error
from broker.listening import SocketFile, listen_tcp, listen_unix
from broker.options import BrokerOptions
from broker.presence_log import log_change
from broker.probe import find_broker
from broker.records import CancelCalls, Discard, Enqueue, Send, SendCalls
from broker.router import Router
from broker.stats import Meter, answer, link_stats, topic_stats
from proto import limits
from proto.aio.forks import drop_in_children
from proto.aio.tasks import keep_running
from proto.errors import ErrorCode
from proto.frames import Batch
from proto.url import BrokerUrl

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path
    from types import TracebackType

    from broker.records import Delivery
    from proto.outbox import Outbox
    from proto.stats import BrokerStats, LinkStats, TopicStats


class Broker:
    """A broker that can be embedded. Enter it to listen, leave it to stop.

    Args:
        options: Where to listen and what to allow.

    Raises (on entry):
        AddressInUseError: Something else listens there.
        ListenError: It cannot listen there for another reason.
    """

    def __init__(self, options: BrokerOptions | None = None) -> None:
        self.options = options or BrokerOptions()
        self.instance = secrets.token_bytes(limits.INSTANCE_BYTES)
        self._drain: Drain | None = None
        self._sessions = count(1)
        self._routers: dict[int, Router] = {}
        self._capacity = Capacity(self.options.max_connections)
        self._meter = Meter()
        self._connections: dict[Connection, None] = {}
        self._strangers: dict[Connection, None] = {}
        """Those that have not finished their handshake."""
        self._next_round = 0.0
        self._joined: dict[Router, dict[int, Connection]] = {}
        self._dirty: dict[Connection, None] = {}
        self._server: asyncio.Server | None = None
        self._ticker: asyncio.Task[None] | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._file: SocketFile | None = None
        self._url: BrokerUrl | None = None
        drop_in_children(self)

    @property
    def loop(self) -> asyncio.AbstractEventLoop:
        """The loop it runs on."""
        assert self._loop is not None, "the broker does not run"
        return self._loop

    @property
    def url(self) -> str:
        """Where nodes find it. RuntimeError if it does not listen."""
        if self._url is None:
            raise RuntimeError("The broker is not listening: use `async with Broker() as broker:`")
        return str(self._url)

    def stats(self) -> BrokerStats:
        """Return what it has done and holds. Two looks give rates: `later.rates_since(earlier)`."""
        stats = self._meter.look(self._now(), self._connections, self._routers.values())
        return replace(stats, broker=self.instance.hex(), refused_connections=self._capacity.refused)

    def topic_stats(self) -> list[TopicStats]:
        """Return the numbers of each topic of each domain."""
        return [topic for router in self._routers.values() for topic in topic_stats(router)]

    def link_stats(self) -> list[LinkStats]:
        """Return the numbers of each link whose handshake is over."""
        now = self._now()
        return [
            link
            for router in self._routers.values()
            for link in link_stats(now, router, self._joined[router])
        ]

    def tell_stats(self, connection: Connection, questions: Iterable[int]) -> None:
        """Answer a connection's INSPECTs: the numbers of the broker, and of the domain that it has joined."""
        router = connection.router
        if router is None:  # it has said goodbye meanwhile
            return
        totals, topics = self.stats(), tuple(topic_stats(router))
        links = tuple(link_stats(self._now(), router, self._joined[router]))
        for question in questions:
            pieces = answer(question, totals, topics, links)
            self.deliver(router, [Send(connection.peer, piece) for piece in pieces])

    def _now(self) -> float:
        return 0.0 if self._loop is None else self._loop.time()

    # Its life

    async def __aenter__(self) -> Self:
        """Listen."""
        self._loop = asyncio.get_running_loop()
        self._drain = None
        # The graphs of an earlier time take no calls, and hold their publishers.
        self._routers, self._joined, self._meter = {}, {}, Meter()
        self._capacity = Capacity(self.options.max_connections)
        self._meter.started_at = self.loop.time()
        self._server = await self._listen()
        check = keep_running("The broker's periodic check", self._check_periodically)
        self._ticker = self._loop.create_task(check)
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Stop."""
        await self.stop()

    async def _listen(self) -> asyncio.Server:
        options, loop, backlog = self.options, self.loop, self._capacity.backlog
        if options.unix is not None:
            url = BrokerUrl("", 0, str(options.unix))
            moving = "Choose another path with --unix"
        else:
            url = BrokerUrl(options.host, options.port)
            moving = "Choose another port with --port"
        try:
            if options.unix is not None:
                server, self._file = await listen_unix(loop, self._new_channel, options.unix, backlog=backlog)
                self._url = BrokerUrl("", 0, _absolute(options.unix))
            else:
                server = await listen_tcp(loop, self._new_channel, url.host, url.port, backlog=backlog)
                self._url = url._replace(port=server.sockets[0].getsockname()[1])
        except (OSError, UnicodeError) as error:
            if isinstance(error, OSError) and error.errno == errno.EADDRINUSE:
                raise address_in_use_error(str(url), await find_broker(url), moving=moving) from error
            raise listen_error(str(url), error, host=url.host, moving=moving) from error
        return server

    def _new_channel(self) -> asyncio.BufferedProtocol:
        return Connection(self).channel

    async def serve_forever(self) -> None:
        """Wait until cancelled."""
        await asyncio.get_running_loop().create_future()

    async def stop(self) -> None:
        """Accept nothing new, finish what has been accepted, say goodbye and close.

        It takes at most `drain_timeout_sec` and two seconds. Cancelled, it closes everything at once.
        """
        server, self._server = self._server, None
        if server is None:
            return
        file, self._file = self._file, None
        if file is not None:  # first: a file that nobody listens at is the next broker's
            file.remove()
        server.close()
        self._drain = Drain(self, self._connections)
        try:
            await self._drain.run(self.options.drain_timeout_sec)
        finally:
            connections = tuple(self._connections)
            for connection in connections:
                connection.channel.abort()
            for connection in connections:
                connection.leave()  # not when its end is noticed: that may be in another time of this broker
            self._url = None
            await self._stop_ticker()

    async def _stop_ticker(self) -> None:
        ticker, self._ticker = self._ticker, None
        if ticker is not None:
            ticker.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await ticker

    async def _check_periodically(self) -> None:
        """Look at every connection's clocks, a few times per keepalive."""
        tick = min(self.options.keepalive_sec, self.options.handshake_timeout_sec) / TICKS_PER_KEEPALIVE
        expected = self.loop.time() + tick
        while True:
            await asyncio.sleep(tick)
            now = self.loop.time()
            self._meter.lag.record(now, max(0.0, now - expected))
            # After a stall of our own the sockets have not been read yet: judge at the next tick.
            stalled, expected = now - expected > tick, now + tick
            if stalled:
                continue
            self._judge(now)
            self.flush()

    def _judge(self, now: float) -> None:
        """Look at those that somebody relies on, a stop on all; at the others, who may be many, in rounds."""
        watched = self.draining or any(router.graph.watched for router in self._routers.values())
        due = dict(self._strangers)
        for graph, joined in self._joined.items():
            due.update((joined[peer], None) for peer in graph.relied_on if peer in joined)
        if watched or now >= self._next_round:
            self._next_round = now + self._round_sec
            due.update((each, None) for each in self._connections if watched or each.look_at <= now)
        for each in due:
            router = each.router
            try:
                each.judge(now, relied_on=watched or (router is not None and each.peer in router.relied_on))
            except Exception:  # noqa: BLE001 - a bug; the other connections must be checked all the same
                logger.exception("Closing %s: its periodic check failed", each)
                each.channel.abort()

    @property
    def _round_sec(self) -> float:
        return min(self.options.idle_keepalive_sec, self.options.suspend_close_sec) / TICKS_PER_KEEPALIVE

    def descriptors(self) -> Iterator[int]:
        """DescriptorOwner: those it listens at, and those of its connections."""
        yield from () if self._server is None else (sock.fileno() for sock in self._server.sockets)
        for connection in tuple(self._connections):
            yield from connection.channel.descriptors()

    # What connections need

    def connection_opened(self, connection: Connection) -> None:
        """A connection has been made."""
        self._connections[connection] = self._strangers[connection] = None
        if len(self._connections) > self._capacity.most:
            connection.turn_away(ErrorCode.LIMIT, self._capacity.refuse(self.loop.time()))

    def connection_closed(self, connection: Connection) -> None:
        """A connection is gone."""
        self._meter.ended(connection.channel)
        self._connections.pop(connection, None)
        self._strangers.pop(connection, None)
        self._dirty.pop(connection, None)
        self.changed()

    @property
    def draining(self) -> bool:
        """Whether it is stopping: nobody may come any more."""
        return self._drain is not None

    def changed(self) -> None:
        """A link has room again, or is gone."""
        if self._drain is not None:
            self._drain.changed()

    def caught_up(self, connection: Connection) -> None:
        """A connection has answered that it knows it is held."""
        if self._drain is not None:
            self._drain.caught_up(connection)

    def routers(self) -> Iterable[Router]:
        """Return the routers of all domains."""
        return self._routers.values()

    def next_session(self) -> int:
        """Return a number for a new session."""
        return next(self._sessions)

    def router(self, domain: int) -> Router:
        """Return the router of a domain's graph."""
        router = self._routers.get(domain)
        if router is None:
            joined: dict[int, Connection] = {}
            router = self._routers[domain] = Router(
                domain=domain,
                max_endpoints=self.options.max_endpoints,
                max_pending_calls=self.options.max_pending_calls,
                max_message_bytes=self.options.max_message_bytes,
                max_queue_bytes=self.options.max_queue_bytes + self.options.max_message_bytes,
                report=lambda endpoint, reason: log_change(
                    domain, joined.get(endpoint.peer.id), endpoint, reason
                ),
            )
            self._joined[router] = joined
        return router

    def joined(self, connection: Connection) -> None:
        """A connection has finished its handshake."""
        assert connection.router is not None
        self._strangers.pop(connection, None)
        self._joined[connection.router][connection.peer] = connection

    def left(self, router: Router, peer: int) -> None:
        """A connection has left its graph."""
        self._joined[router].pop(peer, None)

    def deliver(self, router: Router, deliveries: list[Delivery]) -> None:
        """Put deliveries into their links' outboxes; `flush` sends them."""
        joined, dirty = self._joined[router], self._dirty
        most, most_bulk = self.options.max_queue_bytes, self.options.max_bulk_bytes
        for delivery in deliveries:
            connection = joined.get(delivery.peer)
            if connection is None or not connection.channel.connected:
                lose(delivery)
                continue
            dirty[connection] = None
            outbox = connection.channel.outbox
            _put(connection, outbox, delivery)
            if outbox.undroppable_bytes > most or outbox.bulk_bytes > most_bulk:
                connection.channel.flush()
                _cut_off(connection)

    def flush(self) -> None:
        """Write to every link that was delivered to; end those that are too slow for their queues."""
        while self._dirty:
            dirty, self._dirty = self._dirty, {}
            for connection in dirty:
                connection.channel.flush()
                outbox = connection.channel.outbox
                if outbox.held_bytes > outbox.max_held_bytes:
                    _cut_off(connection)
        if self._drain is not None:
            self._drain.changed()


def _put(connection: Connection, outbox: Outbox, delivery: Delivery) -> None:
    """Put one delivery where it waits for its turn; the commonest kinds are asked for first."""
    if isinstance(delivery, Enqueue):
        outbox.enqueue(delivery.queue, delivery.item)
    elif isinstance(delivery, SendCalls):
        outbox.put_calls(delivery.raw, delivery.key)
    elif isinstance(delivery, Send):
        connection.channel.send(delivery.frame)
    elif isinstance(delivery, CancelCalls):
        outbox.cancel_calls(delivery.endpoint, delivery.calls)
    elif isinstance(delivery, Discard):
        outbox.discard_queue(delivery.queue)
    elif delivery.code == ErrorCode.LIMIT:
        connection.cut_off(delivery.text)
    else:
        connection.end(ErrorCode(delivery.code), delivery.text)


def _cut_off(connection: Connection) -> None:
    """End a link for which more waits than may: what has not left with the last flush will not."""
    why = connection.overdue()
    if why is not None:
        connection.cut_off(why)


def lose(delivery: Delivery) -> None:
    """Count what a delivery means for a link that has ended."""
    if isinstance(delivery, Discard):
        delivery.queue.mark_lost()
    elif isinstance(delivery, Enqueue) and isinstance(delivery.item, Batch):
        delivery.queue.mark_lost(delivery.item)


def _absolute(path: Path) -> str:
    return str(path.absolute())
