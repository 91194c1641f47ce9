"""Everything that waits to be sent on one link, and the order in which it is sent.

Control frames are sent first, then requests and replies, then the publisher queues in turn, one frame each
(docs/protocol.md §6.7). So a declaration or a reply never waits behind messages, and a fast publisher does
not delay a slow one by more than a frame. Large frames leave in fragments, one per turn, so they never block
the link.

Two limits bound an outbox. The messages in all publisher queues together stay below `max_held_bytes`: above
it the fullest KEEP_LAST queues lose their oldest batches. Everything else is never dropped; the outbox counts
its memory, and the owner ends the link above its limits. Requests to a server are limited before they are
queued (see queued_calls.py), because their senders are at fault if there are too many.

The module does no I/O: the owner of a socket takes frames with `pop_frames` and calls `trim` afterwards.
"""

from __future__ import annotations

import sys
from collections import deque
from dataclasses import dataclass, field
from heapq import heapify, heappop, heapreplace
from typing import TYPE_CHECKING, Final

from proto import limits
from proto.limits import FRAME_OVERHEAD_BYTES
from proto.queues.publisher_queue import PublisherQueue
from proto.wire.codec import encode
from proto.wire.fragments import Transfers, is_large
from proto.wire.frames import Batch, Cancel

if TYPE_CHECKING:
    from collections.abc import Sequence

    from proto.queues.publisher_queue import Ordered, ReplaySource
    from proto.queues.queued_calls import CallShare
    from proto.wire.frames import Buffer

REPLAY_AHEAD_BYTES: Final = 1024 * 1024
"""Latched messages that wait in the publisher queues of a link; the others are taken when these are sent."""


class LargeCall(PublisherQueue):
    """A queue that holds one large frame of requests or replies.

    As a queue of its own it takes its turn among the publishers, fragment by fragment. Among the calls it
    would hold up all smaller ones behind it.
    """

    __slots__ = ("key", "share")

    def __init__(self, raw: bytes, key: tuple[int, int] | None, share: CallShare | None) -> None:
        super().__init__(0, None)
        self.key = key
        self.share = share
        self.put(raw)


@dataclass(slots=True, eq=False, repr=False)
class Outbox:
    """Everything that waits on one link.

    The owner puts items in, calls `pop_frames` until it returns nothing or the transport is full, and then
    `trim`. That order makes depth exact: only messages that really cannot be sent are dropped.

    A publisher queue belongs to the publisher's endpoint in its node, or to a route in the broker. The outbox
    only schedules it, and keeps the totals of what its queues hold.
    """

    large_budget: int = field(default=sys.maxsize, init=False)
    """Bytes of large frames to send before other connections are served; set by the owner for each flush."""
    urgent_bytes: int = field(default=0, init=False)
    """Estimated memory of the control frames and calls that wait."""
    ordered_bytes: int = field(default=0, init=False)
    """Estimated memory of the control frames and latched messages that wait in publisher queues."""
    replay_bytes: int = field(default=0, init=False)
    """The part of `ordered_bytes` that is latched messages."""
    bulk_bytes: int = field(default=0, init=False)
    """The part of `urgent_bytes` that is large calls without a share."""
    shared_bytes: int = field(default=0, init=False)
    """The part of `urgent_bytes` that is requests with a share."""
    held_bytes: int = field(default=0, init=False)
    """Estimated memory of the messages in all publisher queues, as of the last `trim`. Not exact in between:
    on a fast link a batch enters and leaves within one loop turn, and to count it would cost for nothing."""
    max_held_bytes: int = field(default=sys.maxsize, init=False)
    """Limit of `held_bytes`; set by the owner."""
    transfers: Transfers = field(default_factory=Transfers)
    """The large frames that are partly sent."""
    dropped: int = field(default=0, init=False)
    """Messages dropped in all because the link was slow."""
    blocked: dict[PublisherQueue, None] = field(default_factory=dict["PublisherQueue", None], init=False)
    """Queues to serve again when the peer has released messages that it got by reference."""
    _control: deque[bytes] = field(default_factory=deque[bytes], init=False)
    _calls: deque[bytes | tuple[bytes, CallShare]] = field(
        default_factory=deque["bytes | tuple[bytes, CallShare]"], init=False
    )
    """Frames of calls, those of requests with the share that counts them."""
    _ready: deque[PublisherQueue] = field(default_factory=deque[PublisherQueue], init=False)
    """The queues with something to send, in the order in which they are served."""
    _touched: dict[PublisherQueue, None] = field(default_factory=dict["PublisherQueue", None], init=False)
    """The queues that got batches since the last `trim`, each once, however many batches these are."""
    large_calls: dict[tuple[int, int], LargeCall] = field(
        default_factory=dict[tuple[int, int], LargeCall], init=False
    )
    """The large frames of calls that wait, by endpoint and call id; read only."""
    _after_calls: dict[int, bytes] = field(default_factory=dict[int, bytes], init=False)
    """By endpoint, the frame that waits until the endpoint's large calls are sent."""

    @property
    def undroppable_bytes(self) -> int:
        """Memory of control frames and small calls, which are never dropped: the owner must limit them.

        Large calls are not included: the owner limits `bulk_bytes` apart, since a few of these are more than
        small frames ever amount to for a peer that reads. Nor are requests with a share and latched messages,
        which have limits of their own.
        """
        others = self.bulk_bytes + self.shared_bytes + self.replay_bytes
        return self.urgent_bytes + self.ordered_bytes - others

    def put_control(self, raw: bytes) -> None:
        """Queue a small encoded frame that is sent before everything else."""
        self._control.append(raw)
        self.urgent_bytes += len(raw) + FRAME_OVERHEAD_BYTES

    def put_calls(
        self, raw: bytes, key: tuple[int, int] | None = None, share: CallShare | None = None
    ) -> None:
        """Queue a frame of requests, replies or cancellations; a large one is served like a publisher queue.

        Args:
            raw: The encoded frame.
            key: Endpoint and call id, by which `drop_call` finds a large frame.
            share: The share that has counted this frame of requests and no longer counts it when it is sent.
        """
        size = len(raw) + FRAME_OVERHEAD_BYTES
        self.urgent_bytes += size
        if share is not None:
            self.shared_bytes += size
        if not is_large(raw):
            self._calls.append(raw if share is None else (raw, share))
            return
        queue = LargeCall(raw, key, share)
        if key is not None:
            self.large_calls[key] = queue
        if share is None:
            self.bulk_bytes += size
        self.schedule(queue)

    def put_after_calls(self, endpoint: int, raw: bytes) -> bool:
        """Queue the last frame of an endpoint, to be sent after all its calls. At most once per endpoint.

        Returns:
            False if it waits for large calls, which may take long.
        """
        self.urgent_bytes += len(raw) + FRAME_OVERHEAD_BYTES
        if self._has_large_calls(endpoint):
            self._after_calls[endpoint] = raw
            return False
        self._calls.append(raw)
        return True

    def _has_large_calls(self, endpoint: int) -> bool:
        return any(owner == endpoint for owner, _ in self.large_calls)

    def _release_after_calls(self, endpoint: int) -> None:
        """Queue the last frame of an endpoint if no large call precedes it any more."""
        if endpoint in self._after_calls and not self._has_large_calls(endpoint):
            self._calls.append(self._after_calls.pop(endpoint))

    def drop_call(self, key: tuple[int, int]) -> bool:
        """Remove a large call; return False if it is not there, because it was sent completely."""
        queue = self.large_calls.pop(key, None)
        if queue is None:
            return False
        self._subtract_large_call(queue, queue.control_bytes)
        abort = queue.discard(self.transfers)
        if abort is not None:
            self.put_control(abort)
        self._release_after_calls(key[0])
        return True

    def _subtract_large_call(self, queue: LargeCall, size: int) -> None:
        """Subtract a large call that is sent or dropped."""
        self.urgent_bytes -= size
        if queue.share is None:
            self.bulk_bytes -= size
        else:
            queue.share.remove(size)
            self.shared_bytes -= size

    def cancel_calls(self, endpoint: int, calls: Sequence[int], share: CallShare | None = None) -> None:
        """Remove those of these calls that are still queued as large frames; send CANCEL for the others.

        Args:
            endpoint: Their endpoint.
            calls: Their ids.
            share: Counts the CANCEL frames while they wait.
        """
        left = [call for call in calls if not self.drop_call((endpoint, call))]
        for start in range(0, len(left), limits.MAX_CALLS_PER_FRAME):
            part = tuple(left[start : start + limits.MAX_CALLS_PER_FRAME])
            raw = encode(Cancel(endpoint, part))
            if share is not None:
                share.add(raw)
            self.put_calls(raw, share=share)

    def enqueue(self, queue: PublisherQueue, item: Batch | Ordered, *, first: bool = False) -> None:
        """Put a batch, or a frame that must stay in order with batches, into a publisher queue.

        Args:
            queue: The queue, which belongs to this outbox.
            item: A batch, latched messages, or another encoded frame.
            first: Whether to insert it before everything in the queue that is not being sent.
        """
        put = queue.put_front if first else queue.put
        if isinstance(item, Batch):
            # Not counted before `trim`: most batches have left by then.
            put(item)
            self._touched[queue] = None
        else:
            control, bulk = queue.control_bytes, queue.bulk_bytes
            put(item)
            self.ordered_bytes += queue.control_bytes - control
            self.replay_bytes += queue.bulk_bytes - bulk
        self.schedule(queue)

    def enqueue_source(self, queue: PublisherQueue, source: ReplaySource) -> None:
        """Put latched messages into a publisher queue, most of them only when they can be sent.

        Many late joiners at once would otherwise hold a copy of everything latched for each of them.
        """
        while 0 < (size := source.next_bytes()) <= REPLAY_AHEAD_BYTES - self.replay_bytes:
            self.enqueue(queue, source.pop())
        if size:
            self.enqueue(queue, source)

    def discard_queue(self, queue: PublisherQueue, *, shed: bool = False) -> int:
        """Abandon everything in a publisher queue; return the number of messages that waited.

        Args:
            queue: The queue.
            shed: Whether its messages count as dropped, and its control frames are still sent.
        """
        pending, waiting = queue.pending, queue.pending + queue.leaving
        # Its DETACHED must still arrive: the reader would otherwise wait for a publisher that is gone.
        kept = queue.control_frames() if shed else ()
        self.ordered_bytes -= queue.control_bytes
        self.replay_bytes -= queue.bulk_bytes
        abort = queue.discard(self.transfers)
        self.blocked.pop(queue, None)
        self._recount(queue)
        if abort is not None:
            self.put_control(abort)
        if shed:
            queue.abandoned -= waiting
            queue.dropped += waiting
            self.dropped += waiting
        for raw in kept:
            self.put_control(raw)
        return pending

    def schedule(self, queue: PublisherQueue, *, trim: bool = False) -> None:
        """Serve a queue if it has something to send; call this when its credit or its link has changed.

        Args:
            queue: The queue.
            trim: Whether less may wait in it now.
        """
        if trim:
            self._touched[queue] = None
        if not queue.scheduled and queue.sendable:
            queue.scheduled = True
            self._ready.append(queue)

    def pop_frames(self, max_bytes: int) -> tuple[list[Buffer], int]:
        """Remove and return the next frames to write.

        Args:
            max_bytes: Stop when the frames have at least this size; the last one may exceed it.

        Returns:
            The encoded frames and their size. A smaller size than `max_bytes` means that nothing else may be
            sent now.
        """
        parts: list[Buffer] = []
        size = 0
        while size < max_bytes:
            # Looked at again for each frame: a queue that ends may release frames that must follow it.
            urgent = self._control or self._calls
            if urgent:
                item = urgent.popleft()
                if isinstance(item, tuple):
                    raw, share = item
                    held = len(raw) + FRAME_OVERHEAD_BYTES
                    self.shared_bytes -= held
                    share.remove(held)
                else:
                    raw = item
                    held = len(raw) + FRAME_OVERHEAD_BYTES
                self.urgent_bytes -= held
                parts.append(raw)
                size += len(raw)
                continue
            if not self._ready or not (taken := self._pop_from_queues(parts)):
                break
            size += taken
        return parts, size

    @property
    def has_more(self) -> bool:
        """Whether queues wait to be served. If `pop_frames` returned nothing, they have large frames only."""
        return bool(self._ready)

    def _pop_from_queues(self, parts: list[Buffer]) -> int:
        """Append the next frame of the next queue to `parts`; return its size, 0 if no queue may send."""
        for _ in range(len(self._ready)):  # each queue once: those that are put back must wait
            queue = self._ready.popleft()
            if self.large_budget <= 0 and queue.is_large:
                self._ready.append(queue)
                continue
            queue.scheduled = False
            control, bulk, count = queue.control_bytes, queue.bulk_bytes, len(parts)
            size = queue.pop_frame(self.transfers, parts)
            if len(parts) - count > 1:  # the head and the payload of a fragment
                self.large_budget -= size
            if queue.counted_bytes:  # not if it was put in since the last `trim`
                self._recount(queue)
            if queue.control_bytes != control:
                self._count_sent_control(queue, control - queue.control_bytes, bulk - queue.bulk_bytes)
            if queue.sendable:  # at the end of the round: every queue sends one frame at a time
                queue.scheduled = True
                self._ready.append(queue)
            if size:
                return size
            if queue.blocked:
                self.blocked[queue] = None
        return 0

    def _count_sent_control(self, queue: PublisherQueue, size: int, bulk: int) -> None:
        if not isinstance(queue, LargeCall):
            self.ordered_bytes -= size
            self.replay_bytes -= bulk
            return
        self._subtract_large_call(queue, size)
        if queue.key is not None and self.large_calls.get(queue.key) is queue:
            del self.large_calls[queue.key]
            self._release_after_calls(queue.key[0])

    def trim(self) -> None:
        """Drop the messages beyond the depths of their queues and beyond `max_held_bytes`.

        Call it after `pop_frames`: what is still queued then cannot be sent now. If `held_bytes` exceeds
        `max_held_bytes` afterwards, nothing is left that may be dropped, and the owner must end the link.
        """
        for queue in self._touched:
            if queue.pending:
                dropped = queue.dropped
                queue.trim()
                if queue.dropped != dropped:
                    self.dropped += queue.dropped - dropped
                    self.schedule(queue)  # a frame behind messages without credit may be the first one now
            elif not queue.counted_bytes:
                continue  # all of it has been sent, as on any link that is fast enough
            self._recount(queue)
        if self.held_bytes > self.max_held_bytes:
            # The margin makes the search over all queues rare: the next messages fit without another one.
            self.drop_from_fullest(self.max_held_bytes - self.max_held_bytes // 32)
        if self._touched:  # not if only calls were sent
            self._touched.clear()

    def _recount(self, queue: PublisherQueue) -> None:
        held = queue.held_bytes
        self.held_bytes += held - queue.counted_bytes
        queue.counted_bytes = held

    def drop_from_fullest(self, enough: int) -> None:
        """Drop the oldest batches of the fullest KEEP_LAST queues until `held_bytes` is at most `enough`."""
        # A heap by what queues hold. The number decides between equals, since queues cannot be compared.
        # KEEP_ALL queues are not in it: credit bounds them, and nothing of them may be dropped.
        fullest = [
            (-queue.held_bytes, number, queue)
            for number, queue in enumerate(
                dict.fromkeys((*self._ready, *self._touched, *self.blocked))  # some lack credit
            )
            if queue.depth is not None and queue.pending > 1
        ]
        heapify(fullest)
        while fullest and self.held_bytes > enough:
            _, number, queue = fullest[0]
            self.dropped += queue.drop_oldest_batch()
            self._recount(queue)
            if queue.pending > 1:
                heapreplace(fullest, (-queue.held_bytes, number, queue))
            else:
                heappop(fullest)
