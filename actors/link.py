"""A node's link to its broker: connects, declares everything, and does so again after every loss.

The link knows endpoints only as things that can declare themselves and be told what the broker says; what a
frame means is theirs. Everything an endpoint sends goes through `Link.channel`, which is None while there is
no open session.
"""

from __future__ import annotations

import asyncio
import os
import random
import secrets
import weakref
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

from actors.errors import BrokerUnreachable, NodeNameTaken
from actors.feeds import Feeds
from actors.interfaces.errors import InvalidMessageError
from actors.pulse import Pulse
from proto import frames, limits
from proto.aio import Channel
from proto.errors import ErrorCode, ProtocolError
from proto.liveness import Finding
from proto.session import Role

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from proto.frames import Frame
    from proto.url import BrokerUrl

FIRST_RETRY_SEC: Final = 0.05
LAST_RETRY_SEC: Final = 2.0
CONNECT_TIMEOUT_SEC: Final = 5.0

HEADER_ROOM_BYTES: Final = 256
"""What a frame around one message, request or reply may take beside it, here and at the broker."""

AGENT: Final = "callboard-python"

F = TypeVar("F")


class LinkLog(Protocol):
    """Where a link reports to: a node's logger."""

    def info(self, message: str, /) -> object:
        """Report progress."""
        ...

    def warning(self, message: str, /) -> object:
        """Report trouble."""
        ...


class Endpoint(Protocol):
    """A node, publisher, subscription, service or client, as its link sees it."""

    id: int

    def declaration(self) -> Frame:
        """Return the frame that declares it."""
        ...

    def accepted(self, number: int) -> None:
        """The broker knows it now; `number` is a publisher's id."""
        ...

    def refused(self, code: int, text: str) -> None:
        """The broker will not have it."""
        ...

    def matched(self, peers: int) -> None:
        """It has this many counterparts now."""
        ...

    def notice(self, kind: int, text: str) -> None:
        """The broker warns about it."""
        ...

    def link_lost(self) -> None:
        """The session has ended; what was in flight is gone."""
        ...


class CreditTaker(Protocol):
    """A publisher that the broker knows."""

    def credit(self, frame: frames.Credit) -> None:
        """CREDIT came."""
        ...


class FlushSource(Protocol):
    """Something that collects what is sent in one loop turn."""

    def flush_turn(self) -> None:
        """Put everything collected into the channel's outbox."""
        ...


class Link:
    """One connection at a time to one of several brokers, kept up until it is closed.

    Args:
        urls: Brokers, in the order in which to try them.
        domain: Which of a broker's disjoint graphs to join.
        log: Gets one line when a broker is missing, and one when it is back.
        jitter: Gives a random factor between 0 and 1 for the waits between attempts.

    Attributes:
        largest: Bytes of the largest message, request or reply that the broker takes.
    """

    def __init__(
        self,
        urls: Sequence[BrokerUrl],
        *,
        domain: int,
        log: LinkLog,
        jitter: Callable[[], float] = random.random,
    ) -> None:
        self.channel: Channel | None = None
        self.loop: asyncio.AbstractEventLoop | None = None
        self.feeds = Feeds()
        self.endpoints: dict[int, Endpoint] = {}
        self.publishers: dict[int, CreditTaker] = {}
        self.connections = 0
        """Sessions opened so far; above 1 there was a loss."""
        self._urls = tuple(urls)
        self._domain = domain
        self._log = log
        self._jitter = jitter
        self._instance = secrets.token_bytes(limits.INSTANCE_BYTES)
        self._token = secrets.token_bytes(limits.INSTANCE_BYTES)
        self._next_id = 1
        self._dirty: dict[FlushSource, None] = {}
        self._flush_due = False
        self._closing = False
        self._connecting: Channel | None = None
        self._hearing: _Hearing | None = None
        self._changed: dict[asyncio.Future[None], None] = {}
        self._keepalive_sec = limits.DEFAULT_KEEPALIVE_SEC
        self.largest = _largest(limits.MAX_MESSAGE_BYTES)
        self._ended: asyncio.Event = asyncio.Event()
        self._pongs: dict[int, asyncio.Future[None]] = {}
        self._next_token = 1
        self._fatal: Exception | None = None
        self._matched: set[int] = set()
        self._handlers: dict[type[Any], Callable[[Any], None]] = {
            frames.Accepted: lambda frame: self._tell(frame.id, "accepted", frame.number),
            frames.Refused: self._on_refused,
            frames.Matched: self._on_matched,
            frames.Notice: lambda frame: self._tell(frame.id, "notice", frame.kind, frame.text),
            frames.Run: self.feeds.run_received,
            frames.Replay: self.feeds.replay_received,
            frames.Attached: self.feeds.attached,
            frames.Detached: self.feeds.detached,
            frames.Credit: self._on_credit,
            frames.Welcome: self._on_welcome,
            frames.Goodbye: lambda _: self._drop(),
            frames.Error: self._on_error,
            frames.Pong: self._on_pong,
        }

    # What endpoints use

    @property
    def connected(self) -> bool:
        """Whether a session is open."""
        return self.channel is not None

    def handle(self, frame: type[F], handler: Callable[[F], None]) -> None:
        """Give every frame of a type to `handler`."""
        self._handlers[frame] = handler

    def add(self, endpoint: Endpoint) -> None:
        """Declare an endpoint now and after every reconnect; gives it its id."""
        endpoint.id = self._next_id
        self._next_id += 1
        self.endpoints[endpoint.id] = endpoint
        if self.channel is not None:
            self.channel.send(endpoint.declaration())

    def require_fits(self, what: str, size: int) -> None:
        """Raise InvalidMessageError if the broker would not take `what`: it would close the link for it."""
        if size > self.largest:
            raise InvalidMessageError(f"{what} has {size} bytes; that is over the limit of {self.largest}")

    def remove(self, endpoint: Endpoint, *, announce: bool = True) -> None:
        """Forget an endpoint; tell the broker unless the endpoint does so itself."""
        self._matched.discard(endpoint.id)
        if self.endpoints.pop(endpoint.id, None) is not None and announce and self.channel is not None:
            self.channel.send(frames.Undeclare(endpoint.id))

    def flush_later(self, source: FlushSource) -> None:
        """Call the source's `flush_turn` at the end of this loop turn, then write."""
        self._dirty[source] = None
        if not self._flush_due and self.loop is not None and not (self.channel and self.channel.reading):
            self._flush_due = True
            self.loop.call_soon(self._flush_if_due)

    def _flush_if_due(self) -> None:
        if self._flush_due:
            self.flush()

    def flush(self) -> None:
        """Write everything collected."""
        self._flush_due = False
        while self._dirty:
            dirty, self._dirty = self._dirty, {}
            for source in dirty:
                source.flush_turn()
        if self.channel is not None:
            self.channel.flush()
        self.wake()

    async def changed(self) -> None:
        """Wait until something about sending has changed: room, credit, a session."""
        assert self.loop is not None
        waiter: asyncio.Future[None] = self.loop.create_future()
        self._changed[waiter] = None
        try:
            await waiter
        finally:
            del self._changed[waiter]

    def wake(self) -> None:
        """Let everybody who waits in `changed` look again."""
        for waiter in self._changed:
            if not waiter.done():
                waiter.set_result(None)

    async def round_trip(self) -> None:
        """Wait until the broker has handled everything written so far.

        Raises:
            BrokerUnreachable: No session, or it ended before the answer.
        """
        if self.channel is None or self.loop is None:
            raise BrokerUnreachable("Not connected to a broker")
        token = self._next_token
        self._next_token += 1
        waiter = self._pongs[token] = self.loop.create_future()
        self.channel.send(frames.Ping(token))
        try:
            await waiter
        finally:
            self._pongs.pop(token, None)

    # The connection's life

    async def run(self, *, connect_timeout_sec: float | None = None) -> None:
        """Connect, and connect again after every loss, until `close`.

        Raises:
            BrokerUnreachable: No first session within `connect_timeout_sec`.
            NodeNameTaken: The broker refused the node's name.
        """
        self.loop = asyncio.get_running_loop()
        deadline = None if connect_timeout_sec is None else self.loop.time() + connect_timeout_sec
        retry = FIRST_RETRY_SEC
        complained = False
        while not self._closing:
            for url in self._urls:
                if await self._connect(url, None if self.connections else deadline):
                    if complained:
                        self._log.info(f"Connected to the broker at {url}")
                    complained = False
                    began = self.loop.time()
                    await self._serve()
                    if self.loop.time() - began > LAST_RETRY_SEC:
                        retry = FIRST_RETRY_SEC
                if self._closing:
                    return
                if self._fatal is not None:
                    raise self._fatal
            if deadline is not None and not self.connections and self.loop.time() >= deadline:
                raise BrokerUnreachable(f"No broker at {self.place}; start one with: callboard broker")
            if not complained:
                complained = True
                self._log.warning(f"No broker at {self.place}; waiting for one. {self._remedy}")
            await asyncio.sleep(self._pause(retry, deadline))
            retry = min(2 * retry, LAST_RETRY_SEC)

    def _pause(self, retry: float, deadline: float | None) -> float:
        assert self.loop is not None
        pause = retry * (0.5 + 0.5 * self._jitter())
        if deadline is None or self.connections:
            return pause
        return max(0.0, min(pause, deadline - self.loop.time()))

    @property
    def place(self) -> str:
        """Where the brokers are, for messages."""
        return ", ".join(map(str, self._urls))

    @property
    def _remedy(self) -> str:
        url = self._urls[0]
        if url.path:
            return f"Start one with: callboard broker --unix {url.path}"
        default = url.port == 7411 and url.host in {"127.0.0.1", "localhost"}
        return "Start one with: callboard broker" + ("" if default else f" --port {url.port}")

    async def _connect(self, url: BrokerUrl, deadline: float | None) -> bool:
        """Open a connection and wait for the WELCOME; False if that does not work."""
        assert self.loop is not None
        self._ended = asyncio.Event()
        self._hearing = _Hearing(self)
        channel = self._connecting = Channel(Role.CLIENT, self._hearing, loop=self.loop)
        end = self.loop.time() + CONNECT_TIMEOUT_SEC
        try:
            async with asyncio.timeout_at(end if deadline is None else min(end, deadline)):
                if url.path:
                    await self.loop.create_unix_connection(lambda: channel, url.path)
                else:
                    await self.loop.create_connection(lambda: channel, url.host, url.port)
                while self.channel is None and not self._ended.is_set():
                    await self.changed()
        except (OSError, TimeoutError, UnicodeError):  # UnicodeError: a host that can be no host's name
            channel.abort()
            self._lost()
        finally:
            self._connecting = None
        return self.channel is not None

    async def _serve(self) -> None:
        """Keep the session alive until it ends."""
        assert self.loop is not None
        channel = self.channel
        assert channel is not None
        tick = self._keepalive_sec / 6
        last_tick = self.loop.time()
        pulse = Pulse(last_tick, self._keepalive_sec)
        try:
            while not self._ended.is_set():
                try:
                    async with asyncio.timeout(tick):
                        await self._ended.wait()
                except TimeoutError:
                    now = self.loop.time()
                    stalled, last_tick = now - last_tick > 2 * tick, now
                    if not stalled:
                        self._judge(channel, pulse, now)
        finally:
            if not self._ended.is_set() and not self._closing:
                channel.abort()

    def _judge(self, channel: Channel, pulse: Pulse, now: float) -> None:
        """Give a sign of life, and look for the broker's."""
        waiting = bool(self._matched or self._changed or self._pongs)
        finding = pulse.look(now, channel.bytes_received, channel.bytes_sent, waiting=waiting)
        if finding is Finding.SILENT:
            self._log.warning(f"The broker has been silent for {pulse.limit_s:g} s; connecting again")
            channel.abort()
            self._lost()
        elif finding is Finding.ASK:
            channel.send(frames.Ping(0))
            channel.flush()
        pulse.looked(channel.bytes_sent)

    async def close(self, *, timeout_sec: float) -> None:
        """Send what is queued, say goodbye and close; give up after `timeout_sec`."""
        self._closing = True
        channel = self.channel
        if channel is not None:
            self.flush()
            try:
                async with asyncio.timeout(timeout_sec):
                    await self.round_trip()
                    channel.send(frames.Goodbye("stopped"))
                    channel.flush()
                    channel.close()
                    await self._ended.wait()
            except (TimeoutError, BrokerUnreachable):
                channel.abort()
        if self._connecting is not None:
            self._connecting.abort()
        self._ended.set()
        self.wake()

    # What the channel tells

    def opened(self) -> None:
        """ChannelHandler: greet."""
        channel = self._connecting
        assert channel is not None
        _links.add(self)
        options: dict[str, frames.Scalar] = {
            "agent": AGENT,
            "domain": self._domain,
            "instance": self._instance,
            "token": self._token,
        }
        channel.send(frames.Hello(limits.PROTOCOL_VERSION, options))

    def frame_received(self, frame: Frame) -> None:
        """ChannelHandler: one frame from the broker."""
        handler = self._handlers.get(type(frame))
        if handler is not None:
            handler(frame)

    def batch_received(self) -> None:
        """ChannelHandler: nothing more to read for now, so what callbacks sent can go."""
        if self._dirty:
            self.flush()

    def room(self) -> None:
        """ChannelHandler: the transport has room."""
        self.wake()

    def failed(self, error: ProtocolError) -> None:
        """ChannelHandler: the broker broke the protocol."""
        self._log.warning(f"Closing the link: the broker sent something wrong: {error}")

    def closed(self, error: Exception | None) -> None:
        """ChannelHandler: the connection is gone."""
        del error  # the log line of the next attempt says what matters
        self._lost()

    def _on_welcome(self, frame: frames.Welcome) -> None:
        self.channel = self._connecting
        assert self.channel is not None
        self.connections += 1
        keepalive_ms = frame.options.get("keepalive_ms")
        if isinstance(keepalive_ms, int) and keepalive_ms > 0:
            self._keepalive_sec = keepalive_ms / 1000
        max_message_bytes = frame.options.get("max_message_bytes")
        if isinstance(max_message_bytes, int):
            self.largest = _largest(max_message_bytes)
        for endpoint in tuple(self.endpoints.values()):
            self.channel.send(endpoint.declaration())
        self.channel.flush()
        self.wake()

    def _on_error(self, frame: frames.Error) -> None:
        if frame.code == ErrorCode.VERSION:
            self._fatal = ProtocolError(ErrorCode.VERSION, frame.text)
        self._log.warning(f"The broker closed the link: {frame.text}")
        self._drop()

    def _on_refused(self, frame: frames.Refused) -> None:
        if frame.code == ErrorCode.NAME_TAKEN:
            self._fatal = NodeNameTaken(frame.text)
            self._drop()
            return
        self._tell(frame.id, "refused", frame.code, frame.text)

    def _on_matched(self, frame: frames.Matched) -> None:
        if frame.peers and frame.id in self.endpoints:
            self._matched.add(frame.id)
        else:
            self._matched.discard(frame.id)
        self._tell(frame.id, "matched", frame.peers)

    def _on_credit(self, frame: frames.Credit) -> None:
        publisher = self.publishers.get(frame.publisher)
        if publisher is not None:
            publisher.credit(frame)

    def _on_pong(self, frame: frames.Pong) -> None:
        waiter = self._pongs.get(frame.token)
        if waiter is not None and not waiter.done():
            waiter.set_result(None)

    def _tell(self, endpoint_id: int, method: str, *args: object) -> None:
        endpoint = self.endpoints.get(endpoint_id)
        if endpoint is not None:
            getattr(endpoint, method)(*args)

    def _drop(self) -> None:
        """End the session from our side."""
        channel = self.channel or self._connecting
        if channel is not None:
            channel.close()
        self._lost()

    def _lost(self) -> None:
        if self._ended.is_set():
            return
        self._ended.set()
        if self._hearing is not None:
            self._hearing.end()
        had_session = self.channel is not None
        self.channel = None
        self.feeds.clear()
        if had_session:
            for endpoint in tuple(self.endpoints.values()):
                endpoint.link_lost()
        self.publishers.clear()
        self._matched.clear()
        for waiter in self._pongs.values():
            if not waiter.done():
                waiter.set_exception(BrokerUnreachable("The link broke before the broker answered"))
        self.flush()  # what has been collected in this turn goes into its queues, and is held to their depth

    def close_inherited(self) -> None:
        """In a forked child: close the copy of the parent's socket, so that the parent's death is seen."""
        channel = self.channel or self._connecting
        descriptor = None if channel is None else channel.fileno()
        if descriptor is not None:
            os.close(descriptor)


def _largest(max_message_bytes: int) -> int:
    """Return the bytes that one message may have. What needs no fragments is never too large."""
    most = max(min(max_message_bytes, limits.MAX_MESSAGE_BYTES), limits.MAX_FRAME_BYTES)
    return most - HEADER_ROOM_BYTES


class _Hearing:
    """One connection's ChannelHandler: tells the link, until the link is done with this connection.

    A connection may take its time to close; its end must not be taken for the end of the next one.
    """

    def __init__(self, link: Link) -> None:
        self._link: Link | None = link

    def end(self) -> None:
        """Tell the link nothing more."""
        self._link = None

    def opened(self) -> None:
        if self._link is not None:
            self._link.opened()

    def frame_received(self, frame: Frame) -> None:
        if self._link is not None:
            self._link.frame_received(frame)

    def batch_received(self) -> None:
        if self._link is not None:
            self._link.batch_received()

    def room(self) -> None:
        if self._link is not None:
            self._link.room()

    def failed(self, error: ProtocolError) -> None:
        if self._link is not None:
            self._link.failed(error)

    def closed(self, error: Exception | None) -> None:
        if self._link is not None:
            self._link.closed(error)


_links: weakref.WeakSet[Link] = weakref.WeakSet()


def _after_fork_in_child() -> None:
    for link in tuple(_links):
        link.close_inherited()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork_in_child)
