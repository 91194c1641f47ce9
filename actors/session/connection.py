"""One connection to a broker: from the attempt to open it, through its session, to its end.

Each attempt has its own object, so that late events of an old connection cannot affect the next one: `end`
parts it from the link, once and for all, and what its channel reports afterwards goes nowhere.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Protocol

from actors.config.credentials import refused_credentials
from actors.errors import BrokerUnreachable, NodeNameTaken, NotAuthorized
from actors.session.dispatch import DISPATCH
from actors.session.keepalive import Keepalive
from actors.session.tls import tls_failure, tls_required
from proto import limits
from proto.aio.connecting import connect
from proto.aio.forks import drop_in_children
from proto.aio.tls import is_tls_error
from proto.errors import ErrorCode, ProtocolError, TlsFileError
from proto.liveness import PeerState
from proto.untrusted_text import peer_text
from proto.wire import frames
from proto.wire.session import Role

if TYPE_CHECKING:
    from actors.config.credentials import Credentials
    from actors.session.link import Link
    from proto.wire.frames import Frame
    from proto.wire.url import BrokerUrl


class LinkLog(Protocol):
    """What a link logs to: a node's logger."""

    def info(self, message: str, /) -> object:
        """Report progress."""
        ...

    def warning(self, message: str, /) -> object:
        """Report trouble."""
        ...


class BrokerConnection:
    """One connection: a ChannelHandler.

    Args:
        link: Gets what the broker sends, until `end`.
        url: The broker.
        hello: The HELLO to send, without the token.
        credentials: Has the token and the files for TLS.
        log: Gets warnings.

    Attributes:
        url: The broker.
        channel: The connection.
        ended: Set when it has ended, whichever side ended it.
        reached: Whether something accepted the connection.
        had_session: Whether the broker has sent WELCOME.
        error: The error of connecting or of TLS; None after a timeout, or if the connection was accepted.
        refusal: Why the broker did not let this node in, or closed the link; for the log.
        fatal: An error that further attempts would repeat, or None.
    """

    def __init__(
        self, link: Link, url: BrokerUrl, hello: frames.Hello, credentials: Credentials, log: LinkLog
    ) -> None:
        assert link.loop is not None
        self.url = url
        self.channel = link.channel_class(Role.CLIENT, self, loop=link.loop)
        self.ended = asyncio.Event()
        self.reached = self.had_session = False
        self.error: Exception | None = None
        self.refusal = ""
        self.fatal: Exception | None = None
        self._loop = link.loop
        self._link: Link | None = link
        self._hello = hello
        self._credentials = credentials
        self._tls_files = credentials.tls
        self._tls_error: OSError | None = None
        self._log = log
        self._keepalive_sec = limits.DEFAULT_KEEPALIVE_SEC
        drop_in_children(self)

    @property
    def is_open(self) -> bool:
        """Whether this is the link's session now."""
        return self._link is not None and self._link.channel is self.channel

    async def open(self, link: Link, deadline: float) -> bool:
        """Connect and wait for the WELCOME.

        Args:
            link: The link; its changes wake this coroutine.
            deadline: Loop time of the end of the attempt.

        Returns:
            Whether there is a session now.
        """
        loop, url = self._loop, self.url
        try:
            async with asyncio.timeout_at(deadline):
                await connect(loop, self.channel, url, self._tls_files)
                self.reached = True
                while not self.is_open and not self.ended.is_set():
                    await link.changed()
        except TimeoutError:
            self.abort()
        except TlsFileError as error:
            # A running node waits until the files are in order again.
            if link.connections:
                self.error = BrokerUnreachable(str(error))
            else:
                self.fatal = error
            self.abort()
        except (OSError, ValueError) as error:  # ValueError: a string that cannot be a host name
            self.error = error
            self.abort()
        if self._tls_error is not None:
            self.error = await asyncio.to_thread(tls_failure, self._tls_error, url, self._tls_files)
        return self.is_open

    async def keep_alive(self, link: Link) -> None:
        """Send signs of life and watch for the broker's until the connection ends."""
        tick = self._keepalive_sec / 6
        last_tick = self._loop.time()
        keepalive = Keepalive(last_tick, self._keepalive_sec)
        while not self.ended.is_set():
            try:
                async with asyncio.timeout(tick):
                    await self.ended.wait()
            except TimeoutError:
                now = self._loop.time()
                link.lag.record(now, max(0.0, now - last_tick - tick))
                # After a pause of this process (a debugger, a suspended laptop) the broker's signs of life
                # may wait unread in the socket: it is judged at the next tick.
                stalled, last_tick = now - last_tick > 2 * tick, now
                for each in tuple(link.ticks):
                    each()
                self.channel.flush()
                if not stalled:
                    self._check(keepalive, now, awaited=link.awaited)

    def _check(self, keepalive: Keepalive, now: float, *, awaited: bool) -> None:
        channel = self.channel
        finding = keepalive.check(now, channel.bytes_received, channel.bytes_sent, awaited=awaited)
        if finding is PeerState.SILENT:
            self._log.warning(f"The broker has been silent for {keepalive.limit_s:g} s; connecting again")
            self.abort()
        elif finding is PeerState.PING_DUE:
            channel.send(frames.Ping(0))
            channel.flush()
        keepalive.checked(channel.bytes_sent)

    # Frames about the session

    def welcomed(self, frame: frames.Welcome) -> None:
        """Begin the session."""
        self.had_session = True
        keepalive_ms = frame.options.get("keepalive_ms")
        if isinstance(keepalive_ms, int) and keepalive_ms > 0:
            self._keepalive_sec = keepalive_ms / 1000
        partial = frame.options.get("max_reassembly_bytes")
        if isinstance(partial, int):
            self.channel.outbox.transfers.max_bytes = partial
        most = frame.options.get("max_message_bytes")
        if self._link is not None:
            self._link.capabilities = frozenset(str(frame.options.get("capabilities", "")).split())
            user = frame.options.get("user")
            self._link.user = user if isinstance(user, str) else None
            self._link.url = str(self.url)  # first: a task that waits for the session may read it
            largest = most if isinstance(most, int) else limits.MAX_MESSAGE_BYTES
            self._link.opened(self.channel, largest, frame.options)

    def turned_away(self, frame: frames.Error) -> None:
        """Handle ERROR: note the broker's reason, and close."""
        text = peer_text(frame.text)
        if frame.code == ErrorCode.TLS_REQUIRED:
            self.error = tls_required(self.url, self._tls_files)
        else:
            self.refusal = f"The broker closed the link: {text}"
        if frame.code == ErrorCode.NAME_TAKEN and self._link is not None:
            self._link.waits_for_name = True
        if frame.code == ErrorCode.VERSION:
            self.fatal = ProtocolError(ErrorCode.VERSION, text)
        elif frame.code == ErrorCode.UNAUTHORIZED:
            self.fatal = refused_credentials(str(self.url), text, self._credentials)
        self.close()

    def name_taken(self, text: str) -> None:
        """Close because another node has this node's name.

        A node that has had its name tries again: the other one may be its own earlier session, or have come
        while the link was broken.
        """
        if self._link is not None and self._link.has_had_name:
            self.refusal = f"The broker refused this node: {text}; trying again"
        else:
            self.fatal = NodeNameTaken(text)
        self.close()

    # ChannelHandler

    def opened(self) -> None:
        """ChannelHandler: send HELLO."""
        if self._link is None:  # it was aborted while it connected
            self.channel.abort()
            return
        name: tuple[str, int] | None = self.channel.extra_info("peername") if not self.url.path else ("", 0)
        host = "?" if name is None else name[0]
        try:
            token = self._credentials.token_for(host, encrypted=self.url.tls)
        except NotAuthorized as error:
            self.refusal = str(error)
            self.fatal = error
            self.close()
            return
        options = self._hello.options if token is None else {**self._hello.options, "auth": token}
        if (identity := self._link.shared_memory.host) is not None and self.url.is_local:
            options = {**options, "host": identity}
        self.channel.send(self._hello._replace(options=options))

    def frame_received(self, frame: Frame) -> None:
        """ChannelHandler: dispatch one frame from the broker."""
        link = self._link
        if link is not None:
            handler = DISPATCH.get(type(frame))
            if handler is not None:
                handler(self, link, frame)

    def read_finished(self) -> None:
        """ChannelHandler: nothing more to read for now."""
        if self._link is not None:
            self._link.read_finished()

    def writable(self) -> None:
        """ChannelHandler: the transport has space."""
        if self._link is not None:
            self._link.wake()

    def failed(self, error: ProtocolError) -> None:
        """ChannelHandler: the broker broke the protocol."""
        if self._link is not None:
            self._log.warning(f"Closing the link: the broker violated the protocol: {peer_text(str(error))}")

    def closed(self, error: Exception | None) -> None:
        """ChannelHandler: the connection is closed."""
        if self._link is not None and not self.had_session and is_tls_error(error):
            self._tls_error = error
        self.end()

    def descriptors(self) -> tuple[int, ...]:
        """DescriptorOwner: the connection's."""
        return self.channel.descriptors()

    # The end

    def end(self) -> None:
        """Mark the connection as ended, and report its loss to the link once."""
        link, self._link = self._link, None
        if link is not None:
            self.ended.set()
            link.lost()

    def close(self) -> None:
        """End the connection; what has been written is still sent."""
        self.channel.close()
        self.end()

    def abort(self) -> None:
        """End the connection now."""
        self.channel.abort()
        self.end()

    def leave(self) -> None:
        """Send GOODBYE after everything written; then the broker closes.

        Closing first could discard what the broker has not read yet.
        """
        if self.is_open:
            self.channel.send(frames.Goodbye("stopped"))
            self.channel.flush()
        elif not self.ended.is_set():
            self.abort()
