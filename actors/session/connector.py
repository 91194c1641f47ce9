"""Keeping a link connected: which broker to try when, the handshake, signs of life, and the end.

A `Connector` tries its brokers in order until one welcomes it, serves that session until it ends, and begins
again, with pauses that grow and are never the same twice. Each connection is a `BrokerConnection` of its own,
so that one which takes its time to close is not taken for the next.
"""

from __future__ import annotations

import asyncio
import random
import secrets
import weakref
from typing import TYPE_CHECKING, Final, Protocol

from actors.errors import BrokerUnreachable, NodeNameTaken
from actors.session.keepalive import Keepalive
from actors.session.start_hint import start_hint
from proto import frames, limits
from proto.aio.channel import Channel
from proto.aio.forks import drop_in_children
from proto.errors import ErrorCode, ProtocolError
from proto.identity import agent
from proto.liveness import PeerState
from proto.session import Role

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.session.link import Link
    from proto.frames import Frame
    from proto.url import BrokerUrl

FIRST_RETRY_SEC: Final = 0.05
LAST_RETRY_SEC: Final = 2.0
CONNECT_TIMEOUT_SEC: Final = 5.0

FIRST_ANSWER_SEC: Final = 1.0
"""How long a node that is entered waits for the first attempt to connect: a broker needs milliseconds."""

AGENT: Final = agent("callboard-python")


class LinkLog(Protocol):
    """Where a link reports to: a node's logger."""

    def info(self, message: str, /) -> object:
        """Report progress."""
        ...

    def warning(self, message: str, /) -> object:
        """Report trouble."""
        ...


class BrokerConnection:
    """One connection, from the dialling to its end: a ChannelHandler.

    Args:
        link: What the broker says goes there, until `end`.
        url: The broker.
        hello: What to greet with.
        log: Hears of a broker that breaks the protocol.

    Attributes:
        url: The broker.
        channel: The connection.
        ended: Set when it is over, whoever ended it.
    """

    def __init__(self, link: Link, url: BrokerUrl, hello: frames.Hello, log: LinkLog) -> None:
        assert link.loop is not None
        self.url = url
        self.channel = Channel(Role.CLIENT, self, loop=link.loop)
        self.ended = asyncio.Event()
        self._link: Link | None = link
        self._hello = hello
        self._log = log

    @property
    def is_open(self) -> bool:
        """Whether this is the link's session now."""
        return self._link is not None and self._link.channel is self.channel

    def opened(self) -> None:
        """ChannelHandler: greet."""
        if self._link is not None:
            self.channel.send(self._hello)

    def frame_received(self, frame: Frame) -> None:
        """ChannelHandler: one frame from the broker."""
        if self._link is not None:
            self._link.frame_received(frame)

    def read_finished(self) -> None:
        """ChannelHandler: nothing more to read for now."""
        if self._link is not None:
            self._link.read_finished()

    def writable(self) -> None:
        """ChannelHandler: the transport has room."""
        if self._link is not None:
            self._link.wake()

    def failed(self, error: ProtocolError) -> None:
        """ChannelHandler: the broker broke the protocol."""
        if self._link is not None:
            self._log.warning(f"Closing the link: the broker sent something wrong: {error}")

    def closed(self, error: Exception | None) -> None:
        """ChannelHandler: the connection is gone."""
        del error  # the log line of the next attempt says what matters
        self.end()

    def descriptors(self) -> tuple[int, ...]:
        """DescriptorOwner: the connection's."""
        return self.channel.descriptors()

    def end(self) -> None:
        """Tell the link that this is over, once."""
        link, self._link = self._link, None
        if link is not None:
            self.ended.set()
            link.lost()

    def close(self) -> None:
        """End it; what has been written still goes out."""
        self.channel.close()
        self.end()

    def abort(self) -> None:
        """End it now."""
        self.channel.abort()
        self.end()


class Connector:
    """Keeps one link connected to one of several brokers, until it is closed.

    Args:
        link: The link.
        urls: Brokers, in the order in which to try them.
        domain: Which of a broker's disjoint graphs to join.
        log: Gets one line when a broker is missing, and one when it is back.
        jitter: Gives a random factor between 0 and 1 for the waits between attempts.

    Attributes:
        trying: False from the moment at which every broker has been tried in vain until the next attempt.
    """

    def __init__(
        self,
        link: Link,
        urls: Sequence[BrokerUrl],
        *,
        domain: int,
        log: LinkLog,
        jitter: Callable[[], float] = random.random,
    ) -> None:
        self._link = link
        self._urls = tuple(urls)
        self._log = log
        self._jitter = jitter
        self._hello = frames.Hello(
            limits.PROTOCOL_VERSION,
            {
                "agent": AGENT,
                "domain": domain,
                "instance": secrets.token_bytes(limits.INSTANCE_BYTES),
                "token": secrets.token_bytes(limits.INSTANCE_BYTES),
            },
        )
        self._connection: BrokerConnection | None = None
        self.trying = True
        self._closing = False
        self._complained = False
        self._refusal = ""
        """What the broker has answered last instead of a WELCOME: it is logged once."""
        self._unwelcoming: BrokerUrl | None = None
        """Where something has last taken a connection without a WELCOME: no broker can be started there."""
        self._error: Exception | None = None
        """Why the first broker could not be reached."""
        self._keepalive_sec = limits.DEFAULT_KEEPALIVE_SEC
        self._fatal: Exception | None = None
        link.handle(frames.Welcome, self._on_welcome)
        link.handle(frames.Goodbye, self._on_goodbye)
        link.handle(frames.Error, self._on_error)
        link.handle(frames.Refused, self._on_refused)

    async def run(self, *, connect_timeout_sec: float | None = None) -> None:
        """Connect, and connect again after every loss, until `leave`.

        Raises:
            BrokerUnreachable: No first session within `connect_timeout_sec`.
            NodeNameTaken: The broker refused the node's name.
            ProtocolError: The broker speaks another version.
        """
        try:
            await self._keep_connected(connect_timeout_sec)
        finally:
            self._stopped_trying()

    def _stopped_trying(self) -> None:
        self.trying = False
        self._link.wake()

    async def first_attempt(self, done: Callable[[], bool]) -> None:
        """Wait until `done`, or until every broker has been tried; `FIRST_ANSWER_SEC` at most.

        When one node has waited in vain, others do not wait for the same brokers until these answer or
        `CONNECT_TIMEOUT_SEC` has passed: many nodes that are entered one after the other wait once.
        """
        loop = asyncio.get_running_loop()
        silent = _silent.setdefault(loop, {})
        if silent.get(self._urls, 0.0) > loop.time():
            return
        try:
            async with asyncio.timeout(FIRST_ANSWER_SEC):
                while self.trying and not done():
                    await self._link.changed()
        except TimeoutError:
            silent[self._urls] = loop.time() + CONNECT_TIMEOUT_SEC

    async def _keep_connected(self, connect_timeout_sec: float | None) -> None:
        link = self._link
        loop = link.loop = asyncio.get_running_loop()
        deadline = None if connect_timeout_sec is None else loop.time() + connect_timeout_sec
        share_until: float | None = loop.time() + FIRST_ANSWER_SEC
        retry = FIRST_RETRY_SEC
        while not self._closing:
            self.trying = True
            until = None if link.connections else deadline
            connection = await self._try_all(loop, until, share_until if until is None else until)
            share_until = None
            if connection is not None:
                began = loop.time()
                await self._serve(connection, loop)
                if loop.time() - began > LAST_RETRY_SEC:
                    retry = FIRST_RETRY_SEC
            if self._fatal is not None:
                raise self._fatal
            if self._closing:
                return
            if connection is None:
                self._stopped_trying()
                self._nobody_answered(too_late=deadline is not None and loop.time() >= deadline)
            pause = retry * (0.5 + 0.5 * self._jitter())
            if deadline is not None and not link.connections:
                pause = max(0.0, min(pause, deadline - loop.time()))
            await asyncio.sleep(pause)
            retry = min(2 * retry, LAST_RETRY_SEC)

    async def _try_all(
        self, loop: asyncio.AbstractEventLoop, deadline: float | None, share_until: float | None
    ) -> BrokerConnection | None:
        """Try each broker once, in order; return the session with the first that has us.

        Args:
            loop: The running loop.
            deadline: When the last of them must have answered; None: each has `CONNECT_TIMEOUT_SEC`.
            share_until: Until then each has an equal share of the time that is left, so that one that takes
                connections and says nothing leaves some to the others. None: no sharing.
        """
        for left, url in zip(range(len(self._urls), 0, -1), self._urls, strict=True):
            now = loop.time()
            until = share_until if left > 1 else deadline
            end = now + CONNECT_TIMEOUT_SEC
            if until is not None:
                end = min(end, now + (until - now) / left)
            connection = await self._connect(url, loop, end)
            if connection is not None:
                if self._complained:
                    self._log.info(f"Connected to the broker at {url}")
                self._complained = False
                self._refusal = ""
                self._unwelcoming = self._error = None
                _silent.get(loop, {}).pop(self._urls, None)
                return connection
            if self._closing or self._fatal is not None:
                break
        return None

    def _nobody_answered(self, *, too_late: bool) -> None:
        """Say so once; raise if there has never been a session, and now it is too late for one."""
        if too_late and not self._link.connections:
            raise BrokerUnreachable(f"No broker at {self._link.place}. {self._hint()}")
        if not self._complained:
            self._complained = True
            self._log.warning(f"No broker at {self._link.place}; waiting for one. {self._hint()}")

    def _hint(self) -> str:
        """Say what to do about it."""
        if self._unwelcoming is None:
            return start_hint(self._urls[0], self._error)
        return f"Something listens at {self._unwelcoming} and has not let this node in"

    async def _connect(
        self, url: BrokerUrl, loop: asyncio.AbstractEventLoop, deadline: float
    ) -> BrokerConnection | None:
        """Open a connection and wait for the WELCOME; None if that does not work."""
        connection = self._connection = BrokerConnection(self._link, url, self._hello, self._log)
        drop_in_children(connection)
        reached = False
        try:
            async with asyncio.timeout_at(deadline):
                if url.path:
                    await loop.create_unix_connection(lambda: connection.channel, url.path)
                else:
                    await loop.create_connection(lambda: connection.channel, url.host, url.port)
                reached = True
                while not connection.is_open and not connection.ended.is_set():
                    await self._link.changed()
        except (
            OSError,
            TimeoutError,
            UnicodeError,
        ) as error:  # UnicodeError: a host that can be no host's name
            connection.abort()
            timed_out = isinstance(error, TimeoutError)  # maybe a deadline's: what has been seen before holds
            if url == self._urls[0] and not timed_out:
                self._error = error
            if not timed_out and self._unwelcoming == url:
                self._unwelcoming = None  # nothing listens there any more
        if connection.is_open:
            return connection
        if reached and self._unwelcoming is None:
            self._unwelcoming = url
        return None

    async def _serve(self, connection: BrokerConnection, loop: asyncio.AbstractEventLoop) -> None:
        """Keep the session alive until it ends."""
        tick = self._keepalive_sec / 6
        last_tick = loop.time()
        keepalive = Keepalive(last_tick, self._keepalive_sec)
        try:
            while not connection.ended.is_set():
                try:
                    async with asyncio.timeout(tick):
                        await connection.ended.wait()
                except TimeoutError:
                    now = loop.time()
                    self._link.lag.record(now, max(0.0, now - last_tick - tick))
                    stalled, last_tick = now - last_tick > 2 * tick, now
                    if not stalled:
                        self._judge(connection, keepalive, now)
        finally:
            if not connection.ended.is_set() and not self._closing:
                connection.abort()

    def _judge(self, connection: BrokerConnection, keepalive: Keepalive, now: float) -> None:
        """Give a sign of life, and look for the broker's."""
        channel = connection.channel
        finding = keepalive.look(now, channel.bytes_received, channel.bytes_sent, waiting=self._link.waits)
        if finding is PeerState.SILENT:
            self._log.warning(f"The broker has been silent for {keepalive.limit_s:g} s; connecting again")
            connection.abort()
        elif finding is PeerState.PING_DUE:
            channel.send(frames.Ping(0))
            channel.flush()
        keepalive.looked(channel.bytes_sent)

    @property
    def ended(self) -> bool:
        """Whether there is no connection: neither a session nor an attempt at one."""
        return self._connection is None or self._connection.ended.is_set()

    @property
    def closing(self) -> bool:
        """Whether it connects no more."""
        return self._closing

    def leave(self) -> None:
        """Connect no more, and say goodbye behind all that has left; then the broker closes.

        To close first could cost the broker what it has not read yet.
        """
        connection = self._connection
        left, self._closing = self._closing, True
        if left or connection is None or connection.ended.is_set():
            return
        if connection.is_open:
            connection.channel.send(frames.Goodbye("stopped"))
            connection.channel.flush()
        else:
            connection.abort()

    def abort(self) -> None:
        """End the connection, if there still is one."""
        self._closing = True
        if self._connection is not None and not self._connection.ended.is_set():
            self._connection.abort()

    # What the broker says about the session

    def _on_welcome(self, frame: frames.Welcome) -> None:
        assert self._connection is not None
        keepalive_ms = frame.options.get("keepalive_ms")
        if isinstance(keepalive_ms, int) and keepalive_ms > 0:
            self._keepalive_sec = keepalive_ms / 1000
        most = frame.options.get("max_message_bytes")
        self._link.url = str(self._connection.url)  # first: whoever waits for the session may ask for it
        self._link.opened(
            self._connection.channel, most if isinstance(most, int) else limits.MAX_MESSAGE_BYTES
        )

    def _on_goodbye(self, frame: frames.Goodbye) -> None:
        del frame
        self._drop()

    def _on_error(self, frame: frames.Error) -> None:
        if frame.code == ErrorCode.VERSION:
            self._fatal = ProtocolError(ErrorCode.VERSION, frame.text)
        if frame.text != self._refusal:
            self._refusal = frame.text
            self._log.warning(f"The broker closed the link: {frame.text}")
        self._drop()

    def _on_refused(self, frame: frames.Refused) -> None:
        if frame.code == ErrorCode.NAME_TAKEN:
            self._fatal = NodeNameTaken(frame.text)
            self._drop()
        else:
            self._link.refused(frame)

    def _drop(self) -> None:
        """End the session from our side."""
        if self._connection is not None:
            self._connection.close()


_silent: Final[weakref.WeakKeyDictionary[asyncio.AbstractEventLoop, dict[tuple[BrokerUrl, ...], float]]] = (
    weakref.WeakKeyDictionary()
)
"""By loop and brokers: until when no node waits for their first answer, as one has waited in vain."""
