"""Latched messages: those of TRANSIENT_LOCAL publishers, kept for late joiners (docs/protocol.md §6.6)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from broker.routing.mirrored import latched_messages_for, successor
from proto import limits
from proto.errors import ErrorCode, ProtocolError
from proto.queues.batches import held_bytes, slice_batch
from proto.queues.publisher_queue import ReplaySource
from proto.wire import frames
from proto.wire.qos import KEEP_ALL, Qos

if TYPE_CHECKING:
    from broker.routing.records import PublisherRecord, Route, SubscriptionRecord
    from proto.wire.frames import Batch

LATCHED_MESSAGES: Final = 1000
"""Messages kept of a KEEP_ALL + TRANSIENT_LOCAL publisher."""

LATCHED_BYTES: Final = limits.MAX_MESSAGE_BYTES + 64 * 1024
"""Estimated memory of what is kept of one publisher: one message of any size, or smaller ones. Beyond it the
oldest messages are dropped, whatever the depth."""

LATCHED_BYTES_PER_LINK: Final = 256 * 1024 * 1024
"""The same for all publishers of one link; beyond it the one that publishes loses its oldest messages."""


def latched_depth(qos: Qos) -> int:
    """Return how many messages of a publisher with this QoS are kept."""
    if not qos.latched:
        return 0
    return LATCHED_MESSAGES if qos.history == KEEP_ALL else qos.depth


def latch(publisher: PublisherRecord, batch: Batch) -> int:
    """Keep a batch; drop the oldest messages beyond the limits.

    Returns:
        How many messages late joiners will miss: those within the depth but beyond a limit in bytes.

    Raises:
        ProtocolError: It is in shared memory, of which it would keep a slot.
    """
    if not batch.raw:
        text = "REFERENCE: the messages of a TRANSIENT_LOCAL publisher must be sent as BATCH"
        raise ProtocolError(ErrorCode.UNEXPECTED, text)
    keep = publisher.keep
    publisher.latched.append(batch)
    publisher.latched_messages += batch.length
    _count(publisher, held_bytes(batch))
    while publisher.latched_messages > keep:
        _unlatch_oldest(publisher, publisher.latched_messages - keep)
    _unlatch_expired(publisher, batch.stamp_ns)
    missed = 0
    while publisher.latched and (
        publisher.latched_bytes > LATCHED_BYTES or publisher.peer.latched_bytes > LATCHED_BYTES_PER_LINK
    ):
        missed += _unlatch_oldest(publisher, publisher.latched_messages)
    return missed


def _unlatch_oldest(publisher: PublisherRecord, most: int) -> int:
    """Drop messages of the oldest batch, at most `most`; return how many."""
    oldest = publisher.latched.popleft()
    gone = min(oldest.length, most)
    publisher.latched_messages -= gone
    _count(publisher, -held_bytes(oldest))
    if gone < oldest.length:
        rest = slice_batch(oldest, gone, oldest.length)
        publisher.latched.appendleft(rest)
        _count(publisher, held_bytes(rest))
    else:
        publisher.unlatched += 1
    return gone


def _unlatch_expired(publisher: PublisherRecord, now_ns: int) -> None:
    lifespan_ns = publisher.wants.lifespan_ns
    latched = publisher.latched
    while lifespan_ns and latched and latched[0].stamp_ns + lifespan_ns < now_ns:
        _unlatch_oldest(publisher, latched[0].length)


def unlatch(publisher: PublisherRecord) -> None:
    """Drop all messages of a publisher that is gone for good."""
    _count(publisher, -publisher.latched_bytes)
    publisher.latched_messages = 0
    publisher.unlatched += len(publisher.latched)
    publisher.latched.clear()


class LatchedExpiry:
    """Drops latched messages of publishers that send nothing newer once they are older than their lifespan.

    The age of a message is the difference between its stamp and the publisher's newest, and the time since
    the first `check` after that one: the clocks of the hosts need not agree.
    """

    def __init__(self) -> None:
        self._newest: dict[PublisherRecord, tuple[int, float]] = {}
        """The next sequence number of each publisher in the last `check`, and when it was first seen."""

    def add(self, publisher: PublisherRecord) -> None:
        """Check a publisher that has latched messages from now on, if they have a lifespan."""
        if publisher.wants.lifespan_ns:
            self._newest.setdefault(publisher, (-1, 0.0))

    def remove(self, publisher: PublisherRecord) -> None:
        """Forget a publisher."""
        self._newest.pop(publisher, None)

    def check(self, now: float) -> None:
        """Drop what has expired.

        Args:
            now: Loop time.
        """
        for publisher, (newest, since) in tuple(self._newest.items()):
            if newest != publisher.next_sequence:
                self._newest[publisher] = publisher.next_sequence, now
            elif publisher.latched:
                _unlatch_expired(publisher, publisher.latched[-1].stamp_ns + int((now - since) * 1e9))
            if not publisher.latched:
                self.remove(publisher)


def _count(publisher: PublisherRecord, size: int) -> None:
    publisher.latched_bytes += size
    publisher.peer.latched_bytes += size
    publisher.peer.all_latched.bytes += size


class LatchedReplay(ReplaySource):
    """The latched messages of one publisher for a subscription that has just attached.

    Each is read only when it is sent. Messages that are not latched any more by then are skipped: newer ones
    have replaced them, or they exceed a limit in bytes. It ends when the two are no longer attached; for
    another broker it goes on while one of its subscriptions is.

    Args:
        publisher: The publisher.
        route: Its route to the subscription's peer.
        subscription: Gets the latest of the latched messages, up to its depth.
    """

    __slots__ = ("_first", "_index", "_publisher", "_route", "_stop", "_subscription")

    def __init__(self, publisher: PublisherRecord, route: Route, subscription: SubscriptionRecord) -> None:
        self._publisher = publisher
        self._route = route
        self._subscription = subscription
        self._stop = publisher.next_sequence
        skip = publisher.latched_messages - latched_messages_for(publisher, subscription)
        self._index = publisher.unlatched
        self._first = self._stop
        for batch in publisher.latched:
            if skip < batch.length:
                self._first = batch.first_sequence + skip
                break
            skip -= batch.length
            self._index += 1

    def _is_attached(self) -> bool:
        publisher, route, subscription = self._publisher, self._route, self._subscription
        if publisher.routes.get(route.peer.id) is not route:
            return False
        if route.subscriptions.get(subscription.id) is not subscription:
            self._subscription = subscription = successor(route, subscription) or subscription
        return route.subscriptions.get(subscription.id) is subscription

    def _next(self) -> Batch | None:
        if not self._is_attached():
            return None
        publisher = self._publisher
        position = max(0, self._index - publisher.unlatched)
        if position >= len(publisher.latched):
            return None
        batch = publisher.latched[position]
        return batch if batch.first_sequence < self._stop else None

    def next_bytes(self) -> int:
        """Return the size of the next latched batch; 0 without one."""
        batch = self._next()
        return 0 if batch is None else len(batch.payload)

    def pop(self) -> frames.Replay:
        """Return the next latched batch. Needs `next_bytes` > 0."""
        batch = self._next()
        assert batch is not None
        self._index = max(self._index, self._publisher.unlatched) + 1
        kept = slice_batch(batch, max(0, self._first - batch.first_sequence), batch.length)
        return frames.Replay(self._subscription.id, *kept[:-1])
