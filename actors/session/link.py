"""What endpoints use of a node's link to its broker: declaring themselves, sending, waiting, being told.

The link knows endpoints only as things that can declare themselves and be told what the broker says; what a
frame means is theirs. Everything an endpoint sends goes through `Link.channel`, which is None while there is
no open session. How a session comes about and ends is the dialer's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

from actors.diagnostics.records import Size
from actors.errors import BrokerUnreachable
from actors.interfaces.errors import InvalidMessageError
from actors.session.attachments import Attachments
from proto import frames, limits
from proto.loop_lag import LoopLag

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable, Iterator

    from proto.aio.channel import Channel
    from proto.frames import Frame

HEADER_ROOM_BYTES: Final = 256
"""What a frame around one message, request or reply may take beside it, here and at the broker."""

F = TypeVar("F")


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

    def matched(self, peers: int, total: int) -> None:
        """It has this many counterparts now, and has had that many in all in this session."""
        ...

    def notice(self, notice: frames.Notice) -> None:
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
    """One session at a time with a broker, as endpoints see it.

    Args:
        place: Where the brokers are, for messages.

    Attributes:
        place: The same.
        channel: The open session's; None without one.
        loop: The loop the node runs on; None before.
        endpoints: Everything to declare, by id.
        publishers: Those that the broker knows, by the id it gave them.
        connections: Sessions opened so far; above 1 there was a loss.
        url: The broker of the session, or of the last one.
        lag: How late the loop is with the keepalive's ticks.
        largest: Bytes of the largest message, request or reply that the broker takes.
    """

    def __init__(self, place: str = "") -> None:
        self.place = place
        self.url = ""
        self.lag = LoopLag()
        self.channel: Channel | None = None
        self.loop: asyncio.AbstractEventLoop | None = None
        self.attachments = Attachments()
        self.endpoints: dict[int, Endpoint] = {}
        self.publishers: dict[int, CreditTaker] = {}
        self.connections = 0
        self.largest = _largest(limits.MAX_MESSAGE_BYTES)
        self._next_id = 1
        self._dirty: dict[FlushSource, None] = {}
        self._flush_due = False
        self._changed: dict[asyncio.Future[None], None] = {}
        self._pongs: dict[int, asyncio.Future[None]] = {}
        self._next_token = 1
        self._matched: set[int] = set()
        self._handlers: dict[type[Any], Callable[[Any], None]] = {
            frames.Accepted: lambda frame: self._tell(frame.id, "accepted", frame.number),
            frames.Refused: self.refused,
            frames.Matched: self._on_matched,
            frames.Notice: lambda frame: self._tell(frame.id, "notice", frame),
            frames.Batch: self.attachments.batch_received,
            frames.Replay: self.attachments.replay_received,
            frames.Attached: self.attachments.attached,
            frames.Detached: self.attachments.detached,
            frames.Assert: self.attachments.asserted,
            frames.Credit: self._on_credit,
            frames.Pong: self._on_pong,
        }

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

    def sizes(self) -> Iterator[Size]:
        """Say how full its maps are."""
        yield Size(name="endpoints", size=len(self.endpoints))
        yield Size(name="publishers with credit", size=len(self.publishers))
        yield Size(name="publishers heard", size=len(self.attachments))
        yield Size(name="waits", size=len(self._changed))
        yield Size(name="round trips", size=len(self._pongs))

    @property
    def sent(self) -> bool:
        """Whether no declaration, call or reply waits to be written; publishers have their own queues."""
        return self.channel is None or not self.channel.outbox.urgent_bytes

    # What the dialer tells

    @property
    def waits(self) -> bool:
        """Whether something here depends on the broker."""
        return bool(self._matched or self._changed or self._pongs)

    def opened(self, channel: Channel, max_message_bytes: int) -> None:
        """A session is open: declare everything."""
        self.channel = channel
        self.connections += 1
        self.largest = _largest(max_message_bytes)
        for endpoint in tuple(self.endpoints.values()):
            channel.send(endpoint.declaration())
        channel.flush()
        self.wake()

    def frame_received(self, frame: Frame) -> None:
        """One frame from the broker."""
        handler = self._handlers.get(type(frame))
        if handler is not None:
            handler(frame)

    def read_finished(self) -> None:
        """Nothing more to read for now, so what callbacks sent can go."""
        if self._dirty:
            self.flush()

    def lost(self) -> None:
        """The session has ended, or there was none in the end."""
        had_session = self.channel is not None
        self.channel = None
        self.attachments.clear()
        if had_session:
            for endpoint in tuple(self.endpoints.values()):
                endpoint.link_lost()
        self.publishers.clear()
        self._matched.clear()
        for waiter in self._pongs.values():
            if not waiter.done():
                waiter.set_exception(BrokerUnreachable("The link broke before the broker answered"))
        self.flush()  # what has been collected in this turn goes into its queues, and is held to their depth

    # What the broker says

    def refused(self, frame: frames.Refused) -> None:
        """The broker will not have an endpoint."""
        self._tell(frame.id, "refused", frame.code, frame.text)

    def _on_matched(self, frame: frames.Matched) -> None:
        if frame.peers and frame.id in self.endpoints:
            self._matched.add(frame.id)
        else:
            self._matched.discard(frame.id)
        self._tell(frame.id, "matched", frame.peers, frame.total)

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


def _largest(max_message_bytes: int) -> int:
    """Return the bytes that one message may have. What needs no fragments is never too large."""
    most = max(min(max_message_bytes, limits.MAX_MESSAGE_BYTES), limits.MAX_FRAME_BYTES)
    return most - HEADER_ROOM_BYTES
