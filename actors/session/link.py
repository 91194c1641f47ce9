"""A node's link to its broker, for endpoints: they declare themselves, send and wait through it.

Everything that an endpoint sends goes through `Link.channel`, which is None while there is no open session.
The connector opens sessions; `dispatch.py` has the method for each frame that arrives.

Endpoints do not write by themselves. They collect what a loop turn sends, and register with `flush_later`; at
the end of the turn each puts one batch, or one frame of calls, into the outbox. The cost of a message is
mostly that of its frame, here and in the broker, so collecting is what makes many messages cheap. It costs no
delay: nothing else could run before the end of the turn.
"""

from __future__ import annotations

import asyncio
import math
import secrets
from contextlib import suppress
from threading import get_ident
from typing import TYPE_CHECKING, Any, Final, Protocol

from actors.errors import BrokerUnreachable
from actors.interfaces.errors import InvalidMessageError
from actors.session.attachments import Attachments
from actors.session.shared_memory import SharedMemory
from proto import limits
from proto.aio.channel import Channel
from proto.loop_lag import LoopLag
from proto.wire import frames

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actors.session.endpoint import LinkEndpoint
    from proto.wire.frames import Options

HEADER_BYTES: Final = 256
"""Bytes reserved for the rest of a frame with one message, request or reply, here and at the broker."""


LINGER_SEC: Final = 0.001
"""The longest wait of a message in shared memory for others."""

LINGER_BYTES: Final = 1024 * 1024
"""The most that waits so."""


class FlushSource(Protocol):
    """Something that collects what is sent in one loop turn."""

    def flush_turn(self) -> None:
        """Put everything collected into the channel's outbox."""
        ...


class Leaving(Protocol):
    """A bare node that has been destroyed."""

    def leave_if_sent(self) -> bool:
        """Leave the graph if nothing waits to be sent any more; return whether it has left."""
        ...


class Linger:
    """Lets messages in shared memory that follow others at once wait for one loop turn more.

    Such a message costs next to nothing itself, but each frame with references wakes the broker and the
    reader, which costs as much as a small message. A turn that adds another message prolongs the wait. The
    limits are checked at the end of a turn, so that a turn's messages are never parted.

    Attributes:
        size: Bytes of the messages that wait.
    """

    __slots__ = ("_added", "_left", "_until", "size")

    def __init__(self) -> None:
        self.size = 0
        self._added = False
        """Whether this turn has added a message that may wait."""
        self._until = 0.0
        """The end of the longest wait of the first message that waits."""
        self._left = -math.inf
        """When the last ones were sent: a message that comes much later does not wait for others."""

    def add(self, size: int, now: float) -> None:
        """Count a message; it may wait if others were sent less than `LINGER_SEC` ago.

        Args:
            size: Its bytes.
            now: The loop's time in seconds.
        """
        if not self.size:
            self._until = now + LINGER_SEC
        self.size += size
        self._added = now - self._left < LINGER_SEC

    def goes_on(self, now: float) -> bool:
        """Return whether to wait for the next turn; called once at the end of each."""
        added, self._added = self._added, False
        return added and self.size < LINGER_BYTES and now < self._until

    def end(self, now: float) -> None:
        """Note that the messages are sent."""
        self.size = 0
        self._added = False
        self._left = now


class Link:
    """One session at a time with a broker, as endpoints see it.

    Args:
        broker_urls: The URLs of the brokers, for messages.
        shared_memory: Where large messages go if the broker is on this host; None for the defaults.

    Attributes:
        broker_urls, shared_memory: The same.
        channel: The channel of the open session; None without one.
        loop: The loop that the node runs on; None before it runs.
        thread: The thread of this loop; None while the node does not run, when any thread may use it.
        endpoints: Everything to declare, by id.
        publishers: The publishers that the broker has accepted, by the id that it gave them.
        matched: Ids of the endpoints that have counterparts.
        answers: By a query's id, or the type hash that it asks for, the function that takes the answers.
        ticks: Called several times within a keepalive limit, while a session is open.
        left: Has an element for each time that another thread has left messages to the loop and the loop has
            not taken them over yet. What this thread sends by itself must not leave before them.
        changes: Endpoints added and removed so far.
        connections: Sessions opened so far; more than 1 if one was lost.
        url: The broker of the session, or of the last one.
        capabilities: What this broker can do beyond the first version of the protocol.
        user: Who this client is to the access rules of the broker of `url`; None if that has none.
        has_had_name: Whether a broker has accepted the node, now or in an earlier session.
        waits_for_name: Whether the broker keeps the node's name for a silent node that may come back.
        token: 16 random, secret bytes; they prove to a broker that a session continues an earlier one.
        lag: How late the loop runs the keepalive's ticks.
        leaving: Bare nodes that leave as soon as everything of theirs has been sent.
        largest: Bytes of the largest message, request or reply that the broker takes.
        channel_class: The class of the channels of its connections.
    """

    channel_class: type[Channel] = Channel

    def __init__(self, broker_urls: str = "", shared_memory: SharedMemory | None = None) -> None:
        self.broker_urls = broker_urls
        self.shared_memory = shared_memory or SharedMemory()
        self.url = ""
        self.capabilities: frozenset[str] = frozenset()
        self.user: str | None = None
        self.token = secrets.token_bytes(limits.INSTANCE_BYTES)
        self.lag = LoopLag()
        self.channel: Channel | None = None
        self.loop: asyncio.AbstractEventLoop | None = None
        self.thread: int | None = None
        self.attachments = Attachments()
        self.endpoints: dict[int, LinkEndpoint] = {}
        self.publishers: dict[int, LinkEndpoint] = {}
        self.matched: set[int] = set()
        self.answers: dict[int | str, Callable[[Any], None]] = {}
        self.ticks: dict[Callable[[], None], None] = {}
        self.leaving: dict[Leaving, None] = {}
        self.left: list[object] = []
        self.changes = self.connections = 0
        self.has_had_name = self.waits_for_name = False
        self.largest = _largest(limits.MAX_MESSAGE_BYTES)
        self._last_id = 0
        self._dirty: dict[FlushSource, None] = {}
        self._flush_due: asyncio.Handle | None = None
        """The flush at the end of the turn. There is one at most: each ends a turn for `_linger`."""
        self._linger = Linger()
        self._changed: dict[asyncio.Future[None], None] = {}
        self._pongs: dict[int, asyncio.Future[None]] = {}

    @property
    def connected(self) -> bool:
        """Whether a session is open."""
        return self.channel is not None

    @property
    def is_behind(self) -> bool:
        """Whether the loop has something to send that was made before now; in any thread."""
        return bool(self.left or self._dirty)

    @property
    def awaited(self) -> bool:
        """Whether something here depends on the broker."""
        return bool(self.matched or self._changed or self._pongs)

    @property
    def sent(self) -> bool:
        """Whether no declaration, call or reply waits to be written; publishers have their own queues."""
        return self.channel is None or not self.channel.outbox.urgent_bytes

    def run(self) -> asyncio.AbstractEventLoop:
        """Belong to the running loop, and to this thread, from now on; return the loop."""
        self.loop, self.thread = asyncio.get_running_loop(), get_ident()
        return self.loop

    def post(self, callback: Callable[..., object], *args: Any) -> None:
        """Call a function in the loop, soon; never if the loop is closed. In any thread."""
        if self.loop is not None:
            with suppress(RuntimeError):
                self.loop.call_soon_threadsafe(callback, *args)

    def require_thread(self) -> None:
        """Raise RuntimeError in another thread than the loop's, while that runs.

        Nothing here is locked, and nothing would wake the loop: a message would leave at the next event.
        """
        if self.thread not in {None, get_ident()} and self.loop is not None and self.loop.is_running():
            raise RuntimeError(
                "A node and all that it has belong to the thread that it runs in, and this is another one:"
                " publish with actors.threads (`thread.publisher(publisher)`), or let the loop do it with"
                " `loop.call_soon_threadsafe(publisher.publish, msg)` or"
                " `asyncio.run_coroutine_threadsafe(...)` (docs/how-to/threads.md)"
            )

    def new_id(self) -> int:
        """Return an id that no endpoint or query of this link has had."""
        self._last_id += 1
        return self._last_id

    def add(self, endpoint: LinkEndpoint) -> None:
        """Give an endpoint its id, and declare it now and after every reconnect."""
        endpoint.id = self.new_id()
        self.endpoints[endpoint.id] = endpoint
        self.changes += 1
        if self.channel is not None:
            self.channel.send(endpoint.declaration())

    def remove(self, endpoint: LinkEndpoint, *, announce: bool = True) -> None:
        """Remove an endpoint; send UNDECLARE unless the endpoint does so itself."""
        self.matched.discard(endpoint.id)
        self.changes += 1
        if self.endpoints.pop(endpoint.id, None) is not None and announce and self.channel is not None:
            self.channel.send(frames.Undeclare(endpoint.id))

    def require_fits(self, what: str, size: int) -> None:
        """Raise InvalidMessageError if `what` is so large that the broker would close the link for it."""
        if size > self.largest:
            raise InvalidMessageError(f"{what} has {size} bytes; that is over the limit of {self.largest}")

    def flush_later(self, source: FlushSource, shared_bytes: int = 0) -> None:
        """Call the source's `flush_turn` at the end of this loop turn, then write.

        Args:
            source: What has collected something.
            shared_bytes: The size of a message that it has put into shared memory, and that may wait for
                others (`Linger`).

        Raises:
            RuntimeError: As `require_thread`. It is asked here, once for what a turn sends: for each message
                it would cost 2 % of `publish`.
        """
        if get_ident() != self.thread:
            self.require_thread()
        if shared_bytes and self.loop is not None:
            self._linger.add(shared_bytes, self.loop.time())
        self._dirty[source] = None
        # While frames are being read, `read_finished` flushes: what callbacks send leaves with the same
        # write.
        if self._flush_due is None and self.loop is not None and not (self.channel and self.channel.reading):
            self._flush_due = self.loop.call_soon(self._end_turn)

    def _end_turn(self) -> None:
        loop, self._flush_due = self.loop, None
        if loop is not None and self._linger.goes_on(loop.time()):
            self._flush_due = loop.call_soon(self._end_turn)
        else:
            self.flush()

    def flush(self) -> None:
        """Write everything collected."""
        if self._flush_due is not None:
            self._flush_due.cancel()
            self._flush_due = None
        if self._linger.size and self.loop is not None:
            self._linger.end(self.loop.time())
        # Until nothing is left: a flush may log, for example, and the line is collected for /rosout.
        while self._dirty:
            dirty, self._dirty = self._dirty, {}
            for source in dirty:
                source.flush_turn()
        if self.channel is not None:
            self.channel.flush()
        self.wake()

    def read_finished(self) -> None:
        """Write what callbacks have sent; there is nothing more to read for now."""
        self.shared_memory.read_finished()
        if self._dirty:
            self.flush()

    async def changed(self) -> None:
        """Wait until something changes on which sending depends: space, credit or the session."""
        assert self.loop is not None
        waiter: asyncio.Future[None] = self.loop.create_future()
        self._changed[waiter] = None
        try:
            await waiter
        finally:
            del self._changed[waiter]

    def wake(self) -> None:
        """Let everything that waits in `changed` check its condition again."""
        # One wake-up for all kinds of changes: waits are rare, and each checks its own condition anyway.
        for waiter in self._changed:
            if not waiter.done():
                waiter.set_result(None)
        if self.leaving:
            for each in tuple(self.leaving):
                if each.leave_if_sent():
                    self.leaving.pop(each, None)

    async def round_trip(self) -> None:
        """Wait until the broker has handled everything written so far.

        Raises:
            BrokerUnreachable: There is no session, or it ended before the answer.
        """
        if self.channel is None or self.loop is None:
            raise BrokerUnreachable("Not connected to a broker")
        token = self.new_id()
        waiter = self._pongs[token] = self.loop.create_future()
        self.channel.send(frames.Ping(token))
        try:
            await waiter
        finally:
            self._pongs.pop(token, None)

    def pong_received(self, token: int) -> None:
        """End the round trip that a PONG answers."""
        waiter = self._pongs.get(token)
        if waiter is not None and not waiter.done():
            waiter.set_result(None)

    def answer_received(self, key: int | str, frame: Any) -> None:
        """Give an answer, or a part of one, to its query."""
        handle = self.answers.get(key)
        if handle is not None:
            handle(frame)
            self.wake()

    def opened(self, channel: Channel, max_message_bytes: int, welcome: Options) -> None:
        """Begin a session: declare everything.

        Args:
            channel: The connection.
            max_message_bytes: The largest frame that the broker takes.
            welcome: The options of its WELCOME.
        """
        self.channel = channel
        self.connections += 1
        self.largest = _largest(max_message_bytes)
        self.shared_memory.begin(channel, self.capabilities, welcome)
        # In the order of their ids, so nodes precede their endpoints. A copy: an endpoint may remove itself.
        for endpoint in tuple(self.endpoints.values()):
            channel.send(endpoint.declaration())
        channel.flush()
        self.wake()

    def lost(self) -> None:
        """End the session, or an attempt at one, and tell each endpoint once."""
        # First: whatever endpoints do below must not send on the old session, whose ids are void.
        had_session, self.channel = self.channel is not None, None
        self.publishers.clear()
        self.matched.clear()
        self.attachments.clear()
        self.shared_memory.end()
        if had_session:
            for endpoint in tuple(self.endpoints.values()):
                endpoint.session_ended()
        for waiter in self._pongs.values():
            if not waiter.done():
                waiter.set_exception(BrokerUnreachable("The link broke before the broker answered"))
        self.flush()  # what was collected goes into the publisher queues, which drop beyond their depth

    def sizes(self) -> Iterator[tuple[str, int]]:
        """Return how full its maps are."""
        yield "endpoints", len(self.endpoints)
        yield "publishers with credit", len(self.publishers)
        yield "publishers heard", len(self.attachments)
        yield "waits", len(self._changed)
        yield "round trips", len(self._pongs)
        yield "queries", len(self.answers)
        yield "leaving nodes", len(self.leaving)


def _largest(max_message_bytes: int) -> int:
    """Return the bytes that one message may have: at least what fits into one frame."""
    most = max(min(max_message_bytes, limits.MAX_MESSAGE_BYTES), limits.MAX_FRAME_BYTES)
    return most - HEADER_BYTES
