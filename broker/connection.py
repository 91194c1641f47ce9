"""One client's connection: the handshake, the keepalive's judgement, and what is said when it ends."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING, Final

from proto import frames, limits
from proto.aio.channel import Channel
from proto.errors import ErrorCode, ProtocolError, escape
from proto.identity import agent
from proto.liveness import Liveness, PeerState
from proto.outbox import Outbox
from proto.session import Role, State

if TYPE_CHECKING:
    from broker.router import Router
    from broker.server import Broker

logger: Final = logging.getLogger("callboard.broker")

AGENT: Final = agent("callboard-broker")

CATCH_UP: Final = 1
"""The token of the PING whose PONG says that what a peer sent before is here."""

TICKS_PER_KEEPALIVE: Final = 6
"""Looks at a peer within the time that it may be silent."""

_OWN_FRAMES: Final = frozenset({frames.Goodbye, frames.Error, frames.Pong, frames.Inspect})
"""What is not for the router."""


class Connection:
    """A ChannelHandler: between one channel and its graph's router.

    Attributes:
        channel: The connection's bytes.
        router: The graph it has joined; None before the handshake.
        peer: Its number in that graph.
        session: Its number in the broker; 0 before the handshake.
        agent: What the client calls itself, fit to be shown.
        opened_at: Loop time of the first moment.
        look_at: Loop time at which to look at it even if nobody relies on it.
        address: Where it comes from: host and port, or "unix socket".
        left: Whether it ends because the client or the broker wants to stop.
        ending: Why it ends; "" until that is known.
        suspended_at: Loop time since which it has been silent too long, or None.
    """

    def __init__(self, broker: Broker) -> None:
        self._broker = broker
        self.router: Router | None = None
        self.peer = 0
        self.session = 0
        self.agent = "?"
        self.address = "?"
        self.left = False
        self.ending = ""
        self.channel = Channel(
            Role.BROKER, self, loop=broker.loop, max_message_bytes=broker.options.max_message_bytes
        )
        self.channel.outbox.max_held_bytes = broker.options.max_link_bytes
        self.opened_at = broker.loop.time()
        self.look_at = 0.0
        self.suspended_at: float | None = None
        self._liveness = Liveness(self.opened_at)
        self._watched_closely = False
        self._questions: list[int] = []
        """Ids of INSPECTs of this read: one look at everything answers all of them."""

    def opened(self) -> None:
        """ChannelHandler: somebody has connected."""
        self.address = self.channel.peer_address
        logger.debug("Connection from %s", self.address)
        self._broker.connection_opened(self)

    def frame_received(self, frame: frames.Frame) -> None:
        """ChannelHandler: a frame that the session allows."""
        if self.router is not None:
            if self.suspended_at is not None:
                self.restore()
            if type(frame) in _OWN_FRAMES:
                self._take_own(frame)
            else:
                self._broker.deliver(self.router, self.router.handle(self.peer, frame))
        elif isinstance(frame, frames.Hello):
            self._greet(frame)
        else:
            self.channel.close()

    def _take_own(self, frame: frames.Frame) -> None:
        if isinstance(frame, frames.Goodbye):
            self._ends(escape(frame.text), left=True)
            self.leave()
        elif isinstance(frame, frames.Error):
            logger.warning("%s closed its link: %s", self, escape(frame.text))
            self._ends(f"it closed its link: {escape(frame.text)}")
            self.channel.close()
        elif isinstance(frame, frames.Inspect):
            self._questions.append(frame.id)
        elif isinstance(frame, frames.Pong) and frame.token == CATCH_UP:
            self._broker.caught_up(self)

    def _greet(self, hello: frames.Hello) -> None:
        if hello.version != limits.PROTOCOL_VERSION:
            text = f"this broker speaks protocol version {limits.PROTOCOL_VERSION}, not {hello.version}"
            raise ProtocolError(ErrorCode.VERSION, text)
        if self._broker.draining:
            raise ProtocolError(ErrorCode.SHUTDOWN, "the broker is stopping")
        options = hello.options
        domain = options.get("domain", 0)
        if type(domain) is not int or not 0 <= domain <= limits.MAX_DOMAIN:
            text = f"HELLO: domain must be from 0 to {limits.MAX_DOMAIN}"
            raise ProtocolError(ErrorCode.MALFORMED, text)
        self.session = self._broker.next_session()
        self.agent = escape(str(options.get("agent", "?")))[:80]
        welcome: dict[str, frames.Scalar] = {
            "agent": AGENT,
            "broker": self._broker.instance,
            "session": self.session,
            "keepalive_ms": round(self._broker.options.keepalive_sec * 1000),
            "max_message_bytes": self._broker.options.max_message_bytes,
            "wall_time_ns": time.time_ns(),
        }
        self.channel.send(frames.Welcome(limits.PROTOCOL_VERSION, welcome))
        router = self._broker.router(domain)
        self.peer, deliveries = router.connect(_identity(options, "instance"), _identity(options, "token"))
        self.router = router
        self._broker.joined(self)
        logger.debug("Session opened: %s", self)
        self._broker.deliver(router, deliveries)

    def read_finished(self) -> None:
        """ChannelHandler: one read has been handled; send what it caused."""
        if self.suspended_at is not None:
            self.restore()  # a PING came: any bytes count
        if self._questions:
            questions, self._questions = self._questions, []
            self._broker.tell_stats(self, questions)
        self._broker.flush()

    def writable(self) -> None:
        """ChannelHandler: the peer reads again."""
        self._broker.changed()

    def failed(self, error: ProtocolError) -> None:
        """ChannelHandler: the peer broke the protocol."""
        logger.warning("Closing %s: %s: %s", self, error.code.name, escape(str(error)))
        # Its connection may last until it has read why: nobody should wait for it so long. But not now: the
        # broker may be in the midst of deliveries.
        self._ends(f"{error.code.name}: {escape(str(error))}")
        self._broker.loop.call_soon(self.leave)

    def closed(self, error: Exception | None) -> None:
        """ChannelHandler: the connection is gone."""
        self._ends("connection lost" if error is None else f"connection lost: {error}")
        logger.debug("Connection from %s ended: %s", self.address, self.ending)
        self.leave()
        self._broker.connection_closed(self)

    def leave(self) -> None:
        """Take the peer out of its graph, and close."""
        router, self.router = self.router, None
        if router is not None:
            self._ends("")
            deliveries = router.disconnect(self.peer)
            self._broker.left(router, self.peer)
            self._broker.deliver(router, deliveries)
            self._broker.flush()
        self.channel.close()

    def _ends(self, reason: str, *, left: bool = False) -> None:
        """Note why it ends; the first reason is the one."""
        if not self.ending:
            stopping = self._broker.draining
            self.left = left or stopping
            self.ending = "the broker is stopping" if stopping else reason or "closed"

    def end(self, code: ErrorCode, text: str) -> None:
        """Tell the peer why, and close."""
        self.channel.fail(ProtocolError(code, text))

    def cut_off(self, text: str) -> None:
        """Too much waits for the peer: tell it why, and forget what waits before it has read that."""
        if self.channel.connected:
            self.end(ErrorCode.LIMIT, text)
            self._broker.loop.call_soon(self._forget)  # when it has left its graph

    def _forget(self) -> None:
        self.channel.outbox = Outbox()

    def turn_away(self, code: ErrorCode, text: str) -> None:
        """Tell a peer why there is no room for it, and close, without a line in the log for each."""
        self.channel.send(frames.Error(code, text))
        self.channel.flush()
        self.channel.close()

    def ask_to_catch_up(self) -> bool:
        """The broker stops, the peer has been told what to hold back: ask it to say when it knows.

        Returns:
            False if nothing is to be waited for: it has no session.
        """
        if self.channel.session.state is not State.OPEN:
            return False
        self.channel.send(frames.Ping(CATCH_UP))
        return True

    @property
    def has_unsent(self) -> bool:
        """Whether anything waits for a peer that may still take it."""
        if not self.channel.connected or self.suspended_at is not None:
            return False
        outbox = self.channel.outbox
        # A broker's publisher queues have no credit: they wait for the transport only.
        return outbox.undroppable_bytes > 0 or outbox.has_more

    def say_goodbye(self) -> None:
        """The broker stops, and has nothing more to say; the peer closes when it has heard."""
        if self.channel.session.state is State.OPEN:
            self.channel.send(frames.Goodbye("the broker is stopping"))
            self.channel.flush()
        else:
            self.channel.close()

    def overdue(self) -> str | None:
        """Say why this peer must go, if more waits for it than may, and cannot be dropped."""
        outbox, options = self.channel.outbox, self._broker.options
        if outbox.bulk_bytes > options.max_bulk_bytes:
            # However fast it reads: so much may come for it at once.
            return (
                f"{outbox.bulk_bytes} bytes of latched messages and large calls wait for this link,"
                f" and {options.max_bulk_bytes} may (the broker's --max-bulk-bytes)"
            )
        if outbox.undroppable_bytes > options.max_queue_bytes:
            what, limit = "calls and control frames", options.max_queue_bytes
        elif outbox.held_bytes > options.max_link_bytes:
            what, limit = "messages that must not be dropped", options.max_link_bytes
        else:
            return None
        return f"more than {limit} bytes of {what} wait for this link: it reads too slowly"

    def judge(self, now: float, *, relied_on: bool) -> None:
        """Look at the clock: handshake, keepalive, suspension. Called by the broker's ticker."""
        options, channel = self._broker.options, self.channel
        if self.router is None:
            if now - self.opened_at > options.handshake_timeout_sec:
                seconds = f"{options.handshake_timeout_sec:g} s"
                self.end(ErrorCode.TIMEOUT, f"no finished handshake within {seconds}")
            return
        if self.suspended_at is not None:
            if now - self.suspended_at > options.suspend_close_sec:
                self.end(ErrorCode.TIMEOUT, f"silent for {now - self._liveness.heard_at:.0f} s")
                channel.abort()
            return
        limit = options.keepalive_sec
        if not relied_on:
            limit = max(limit, options.idle_keepalive_sec)
        finding = self._liveness.check(now, channel.bytes_received, limit)
        if self._watched_closely and self._liveness.heard_at == now:
            self.router.heard(self.peer)
        # What came before somebody asked is no answer.
        self._watched_closely = self.peer in self.router.relied_on
        if finding is PeerState.PING_DUE:
            channel.send(frames.Ping(0))
        elif finding is PeerState.SILENT:
            silent = now - self._liveness.heard_at
            logger.warning("%s has been silent for %.1f s: suspended", self, silent)
            self.suspended_at = now
            self._broker.deliver(self.router, self.router.suspend(self.peer))
        else:
            self.look_at = now + limit / TICKS_PER_KEEPALIVE
            return
        self.look_at = now

    def silent_s(self, now: float) -> float:
        """Return for how long nothing has come, as far as the looks at it know."""
        return self._liveness.silent_s(now, self.channel.bytes_received)

    def restore(self) -> None:
        """The peer has been heard of again."""
        self.suspended_at = None
        if self.router is not None:
            logger.warning("%s is back", self)
            self._broker.deliver(self.router, self.router.restore(self.peer))

    def __str__(self) -> str:
        nodes = [] if self.router is None else self.router.node_names(self.peer)
        where = ", ".join((*nodes, self.address))
        return f"link {self.peer or '(no handshake)'} [{self.agent}] ({where})"


def _identity(options: frames.Options, key: str) -> bytes:
    value = options.get(key)
    if type(value) is not bytes or len(value) != limits.INSTANCE_BYTES:
        text = f"HELLO: {key} must be {limits.INSTANCE_BYTES} bytes"
        raise ProtocolError(ErrorCode.MALFORMED, text)
    return value
