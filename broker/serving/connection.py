"""One client's connection: passes the frames that its channel receives to the router of its graph."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from broker.access.transport import address_text, is_same_user, origin_of
from broker.routing.router import REPORTED
from broker.serving.link import CATCH_UP, Link, logger
from broker.serving.shared_memory import LinkMemory
from proto import limits
from proto.aio.budgeted_channel import BudgetedChannel
from proto.aio.tls import is_tls_error
from proto.errors import ErrorCode, ProtocolError
from proto.untrusted_text import escape, peer_text
from proto.wire import frames
from proto.wire.addresses import parse_client_address
from proto.wire.codes import Capability
from proto.wire.fragments import Reassembler
from proto.wire.identity import agent
from proto.wire.references import bytes_head
from proto.wire.session import Role
from proto.wire.tls import describe

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Iterator

    from broker.serving.dispatcher import Dispatcher
    from broker.serving.inspections import Inspections
    from proto.wire.addresses import Address

AGENT: Final = agent("callboard-broker")

OTHER_USER: Final = "at its unix socket this broker accepts only connections of its own user"

_MESSAGES: Final = frozenset(
    {frames.Batch, frames.Request, frames.Reply, frames.Cancel, frames.Grant, frames.Credit}
)
"""Frames for the router that cause no reports: the great majority."""

_SHARED_MEMORY: Final = frozenset(
    {frames.Reference, frames.Release, frames.Arena, frames.Mapped, frames.Proof}
)

_OWN_FRAMES: Final = _SHARED_MEMORY | {
    *(frames.Goodbye, frames.Error, frames.Ping, frames.Pong, frames.Inspect)
}
"""Frames that are not for the router."""


class Connection:
    """A ChannelHandler between one channel and its graph's router.

    Args:
        loop: The broker's event loop.
        dispatcher: The broker's links and graphs.
        inspections: Answers INSPECT.
        instance: The broker's random identity.
        sessions: Numbers for new sessions.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        dispatcher: Dispatcher,
        inspections: Inspections,
        instance: bytes,
        sessions: Iterator[int],
    ) -> None:
        self._loop = loop
        self._dispatcher = dispatcher
        self._inspections = inspections
        self._instance = instance
        self._sessions = sessions
        options, budget = dispatcher.options, dispatcher.budget
        assert budget is not None
        self.channel = BudgetedChannel(
            Role.BROKER,
            self,
            loop=loop,
            budget=budget,
            reassembler=Reassembler(
                options.max_message_bytes, dispatcher.max_reassembly_bytes, dispatcher.reassembly
            ),
            received=dispatcher.received,
        )
        self._link = Link(self.channel, options, loop.time())

    def opened(self) -> None:
        """ChannelHandler: the transport is open."""
        link, channel = self._link, self.channel
        link.address = address_text(channel.extra_info)
        link.origin = origin_of(channel.extra_info)
        logger.debug("Connection from %s", link.address)
        # Before the check below: `closed` follows for refused connections, too, and undoes the counts.
        self._dispatcher.open(link)
        if not (self._dispatcher.options.insecure or is_same_user(channel.extra_info)):
            text = "Refused a connection from another user of this machine"
            self._dispatcher.warnings.warn("connections from other users", text)
            link.refuse(ErrorCode.UNAUTHORIZED, OTHER_USER)

    def frame_received(self, frame: frames.Frame) -> None:
        """ChannelHandler: a frame that the session allows."""
        link = self._link
        router = link.router
        if router is not None:
            if link.suspended_at is not None:
                self._dispatcher.restore(link)
            # By frequency: nearly all frames are messages, and one look at a set is all they pay.
            kind = type(frame)
            if kind in _MESSAGES:
                self._dispatcher.deliver(router, router.handle(link.peer, frame))
            elif kind in _OWN_FRAMES:
                self._handle_own(frame)
            else:
                self._dispatcher.deliver(router, router.handle(link.peer, frame))
                self._note_change(kind)
        elif isinstance(frame, frames.Hello):
            self._greet(frame)
        else:  # no session: the client was refused, or has left its graph
            self.channel.close()

    def _note_change(self, kind: type[Any]) -> None:
        """Report later what a frame of this type has changed."""
        if kind in REPORTED:
            self._dispatcher.reports.report_soon()
        if kind is frames.Watch:  # the answer costs much more than the question
            self.channel.end_share()

    def _handle_own(self, frame: frames.Frame) -> None:
        if type(frame) in _SHARED_MEMORY:
            self._handle_shared(frame)
        elif isinstance(frame, frames.Ping):
            self._dispatcher.reports.answer_ping(self._link, frame.token)
        elif isinstance(frame, frames.Goodbye):
            # The reason first: `leave` logs the nodes of the link with it.
            self._dispatcher.note_ending(self._link, peer_text(frame.text), left=True)
            self._dispatcher.leave(self._link)
        elif isinstance(frame, frames.Error):
            text = peer_text(frame.text)
            reason = "links closed by their clients"
            self._dispatcher.warnings.warn(reason, "%s closed its link: %s", self._link, text)
            self._dispatcher.note_ending(self._link, f"it closed its link: {text}")
            self.channel.close()
        elif isinstance(frame, frames.Inspect):
            assert self._link.router is not None
            self._inspections.add(self._link, self._link.router, frame.id)
            self.channel.end_share()  # the answer costs much more than the question
        elif isinstance(frame, frames.Pong) and frame.token == CATCH_UP:
            self._dispatcher.caught_up(self._link)

    def _handle_shared(self, frame: frames.Frame) -> None:
        link, dispatcher = self._link, self._dispatcher
        memory, router = link.memory, link.router
        if memory is None or router is None:
            text = f"{type(frame).__name__.upper()} without shared memory"
            raise ProtocolError(ErrorCode.UNEXPECTED, text)
        if isinstance(frame, frames.Reference):
            batch = memory.batch(frame)
            size, most = len(bytes_head(batch)) + frame.size, dispatcher.options.max_message_bytes
            if size > most:
                text = f"a message of {size} bytes is over the limit of {most}"
                raise ProtocolError(ErrorCode.TOO_LARGE, text)
            # A reference stands for a large message, so it is refused when fragments of one would be.
            if dispatcher.reassembly.refusing:
                dispatcher.reassembly.refuse()
            else:
                dispatcher.deliver(router, router.handle(link.peer, batch))
        elif isinstance(frame, frames.Release):
            # Queues that waited for slots can send again: as if the transport had space again.
            memory.released(frame)
            self.channel.flush()
            self.writable()
        elif isinstance(frame, frames.Mapped):
            memory.opened(frame)
        elif isinstance(frame, frames.Proof):
            memory.prove(frame)
        elif isinstance(frame, frames.Arena):
            memory.open(frame)

    def _greet(self, hello: frames.Hello) -> None:
        if hello.version != limits.PROTOCOL_VERSION:
            text = f"this broker speaks protocol version {limits.PROTOCOL_VERSION}, not {hello.version}"
            raise ProtocolError(ErrorCode.VERSION, text)
        if self._dispatcher.draining:
            raise ProtocolError(ErrorCode.SHUTDOWN, "the broker is stopping")
        options = hello.options
        domain = options.get("domain", 0)
        if type(domain) is not int or not 0 <= domain <= limits.MAX_DOMAIN:
            text = f"HELLO: domain must be from 0 to {limits.MAX_DOMAIN}"
            raise ProtocolError(ErrorCode.MALFORMED, text)
        link = self._link
        origin = origin_of(self.channel.extra_info)  # with the certificate: TLS is established now
        link.origin = replace(origin, client=_client_address(options))
        if link.origin.client is not None:
            link.address += f" for {link.origin.client}"
        if not self._dispatcher.identify(link, options.get("auth"), self._loop.time()):
            return
        link.session = next(self._sessions)
        link.agent = escape(str(options.get("agent", "?")))[:80]
        welcome: dict[str, frames.Scalar] = {
            "agent": AGENT,
            "broker": self._instance,
            "session": link.session,
            "keepalive_ms": round(self._dispatcher.options.keepalive_sec * 1000),
            "max_message_bytes": self._dispatcher.options.max_message_bytes,
            "max_reassembly_bytes": self._dispatcher.max_reassembly_bytes,
            "wall_time_ns": time.time_ns(),
            **self._capabilities(options),
        }
        if link.principal is not None:
            welcome["user"] = link.principal.user
        # Before `join`: the frames that it delivers must come after WELCOME.
        self.channel.send(frames.Welcome(limits.PROTOCOL_VERSION, welcome))
        identity = _identity(options, "instance"), _identity(options, "token")
        self._dispatcher.join(link, domain, *identity)
        logger.debug("Session opened: %s", link)

    def _capabilities(self, options: frames.Options) -> dict[str, frames.Scalar]:
        """Return the options of WELCOME that say what the broker can do for a client with these of HELLO."""
        words = [*Capability]
        shared, link = self._dispatcher.shared_memory, self._link
        same_user = is_same_user(self.channel.extra_info)
        # Only processes of the broker's user can read the secret in /proc; others do not learn where it is.
        secret = shared.offer(options.get("host")) if same_user else {}
        if secret:
            link.memory = LinkMemory(
                self.channel, link.session, shared, self._loop, sent=self._flush, warn=self._warn_of_arena
            )
        else:
            words.remove(Capability.SHARED_MEMORY)
        return {"capabilities": " ".join(words), **secret}

    def _flush(self) -> None:
        """Write what was sent to the link without a delivery; close it if it is over its limits."""
        self.channel.flush()
        self._link.fail_if_over_limit()
        self._dispatcher.memory.count(self._link)

    def _warn_of_arena(self, problem: str) -> None:
        text = "No shared memory with %s: %s"
        self._dispatcher.warnings.warn("links without shared memory", text, self._link, problem)

    def read_finished(self) -> None:
        """ChannelHandler: one read has been handled; send what its frames caused."""
        link = self._link
        if link.suspended_at is not None:
            self._dispatcher.restore(link)  # any bytes show that the peer is alive, even a part of a frame
        if self.channel.reassembler.held_bytes:
            self._dispatcher.note_partial(link)
        self._dispatcher.flush()

    def writable(self) -> None:
        """ChannelHandler: the transport has space again."""
        if self._link.held_bytes:
            self._dispatcher.memory.count(self._link)
        self._dispatcher.note_progress()

    def failed(self, error: ProtocolError) -> None:
        """ChannelHandler: the peer broke the protocol or a limit."""
        reason = peer_text(str(error))
        line = "Closing %s: %s: %s", self._link, error.code.name, reason
        if error.code is ErrorCode.NAME_TAKEN:  # not worth a warning: the node tries again
            logger.debug(*line)
        else:
            self._dispatcher.warnings.warn(f"links closed with {error.code.name}", *line)
        self._dispatcher.note_ending(self._link, f"{error.code.name}: {reason}")
        # The connection lasts until the peer has read the reason; its nodes leave the graph before that, so
        # that nobody calls them. Not in this call: it may be part of a delivery, which iterates over links.
        self._loop.call_soon(self._dispatcher.leave, self._link)

    def closed(self, error: Exception | None) -> None:
        """ChannelHandler: the connection has ended."""
        link = self._link
        if is_tls_error(error):
            reason = describe(error)
            # Once there is a session, it is a broken connection like any other.
            if not link.session:
                self._dispatcher.limit_counts.tls_failures += 1
                self._dispatcher.warnings.warn("failures of TLS", "Closing %s: TLS: %s", link, reason)
            self._dispatcher.note_ending(link, f"TLS: {reason}")
        self._dispatcher.note_ending(
            link, "connection lost" if error is None else f"connection lost: {error}"
        )
        logger.debug("Connection from %s ended: %s", link.address, link.ending)
        self._dispatcher.close(link)


def _client_address(options: frames.Options) -> Address | None:
    if "client_address" not in options:
        return None
    try:
        return parse_client_address(options["client_address"])
    except ValueError:
        text = "HELLO: client_address must be an IP address, such as 192.0.2.7 or 2001:db8::7"
        raise ProtocolError(ErrorCode.MALFORMED, text) from None


def _identity(options: frames.Options, key: str) -> bytes:
    value = options.get(key)
    if type(value) is not bytes or len(value) != limits.INSTANCE_BYTES:
        text = f"HELLO: {key} must be {limits.INSTANCE_BYTES} bytes"
        raise ProtocolError(ErrorCode.MALFORMED, text)
    return value
