"""What waits to be sent on one link, and in which order it goes. Pure: whoever owns a socket pulls from it.

Control frames go first, then requests and replies, then the *lanes* in turn. A lane is one publisher's queue:
its depth bounds the messages in it, exactly, by dropping the oldest when they cannot leave; its credit, where
it has one, holds them back. Large frames leave in fragments, one at each turn of their lane, so they hold up
nobody. The messages of all lanes together have a ceiling in bytes; what is never dropped is counted for the
owner to cap: small frames, and apart from them large calls and latched messages, a few of which are much.
"""

from __future__ import annotations

import sys
from collections import deque
from heapq import heapify, heappop, heapreplace
from typing import TYPE_CHECKING

from proto import limits
from proto.codec import encode
from proto.fragments import is_large
from proto.frames import Batch, Cancel, Replay
from proto.publisher_queue import PublisherQueue, Transfers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from proto.frames import Buffer


class _LargeCall(PublisherQueue):
    """A lane of its own for one large frame of requests or replies."""

    __slots__ = ("key",)

    def __init__(self, raw: bytes, key: tuple[int, int] | None) -> None:
        super().__init__(0, None)
        self.key = key
        self.put(raw)


class Outbox:
    """Everything that waits on one link.

    The owner puts things in, calls `next` until it gets None or its transport is full, and then `trim`: so
    only what cannot leave is dropped.

    Attributes:
        large_budget: Bytes of large messages to send before other connections are served; set by the owner.
        urgent_bytes: Bytes of control frames and calls that wait.
        ordered_bytes: Bytes of control frames and latched messages that wait in lanes, in order with runs.
        bulk_bytes: What large calls and latched messages are of these.
        held_bytes: What the messages that wait in all lanes take, as of the last `trim`.
        max_held_bytes: What they may take, or the fullest lanes are cut; the owner sets it.
        dropped: Messages dropped here, in all, because the link was slow.
    """

    __slots__ = (
        "_behind_calls",
        "_calls",
        "_control",
        "_large_calls",
        "_ready",
        "_touched",
        "_transfers",
        "bulk_bytes",
        "dropped",
        "held_bytes",
        "large_budget",
        "max_held_bytes",
        "ordered_bytes",
        "urgent_bytes",
    )

    def __init__(self) -> None:
        self._control: deque[bytes] = deque()
        self._calls: deque[bytes] = deque()
        self._ready: deque[PublisherQueue] = deque()
        self._touched: list[PublisherQueue] = []
        self._large_calls: dict[tuple[int, int], _LargeCall] = {}
        self._behind_calls: dict[int, bytes] = {}
        """By endpoint, what waits until its large calls have left."""
        self._transfers = Transfers()
        self.large_budget = sys.maxsize
        self.urgent_bytes = 0
        self.ordered_bytes = 0
        self.bulk_bytes = 0
        self.held_bytes = 0
        self.max_held_bytes = sys.maxsize
        self.dropped = 0

    @property
    def undroppable_bytes(self) -> int:
        """Bytes of control frames and small calls, which are never dropped: the owner must cap them.

        So are large calls and latched messages, which `bulk_bytes` counts: a few of them are more than would
        ever wait of small ones for a peer that reads.
        """
        return self.urgent_bytes + self.ordered_bytes - self.bulk_bytes

    def put_control(self, raw: bytes) -> None:
        """Queue a frame that goes before everything else. Never a large one."""
        self._control.append(raw)
        self.urgent_bytes += len(raw)

    def put_calls(self, raw: bytes, key: tuple[int, int] | None = None) -> None:
        """Queue a frame of requests, replies or cancellations.

        A large one takes its turn with the lanes; `key` (endpoint, call id) names it for `drop_call`.
        """
        self.urgent_bytes += len(raw)
        if not is_large(raw):
            self._calls.append(raw)
            return
        queue = _LargeCall(raw, key)
        if key is not None:
            self._large_calls[key] = queue
        self.bulk_bytes += len(raw)
        self._schedule(queue)

    def put_after_calls(self, endpoint: int, raw: bytes) -> bool:
        """Queue a small frame behind all calls of an endpoint that are here, its last word. Once for each.

        Returns:
            False if it waits for large ones, which may take long.
        """
        self.urgent_bytes += len(raw)
        if self._has_large_calls(endpoint):
            self._behind_calls[endpoint] = raw
            return False
        self._calls.append(raw)
        return True

    def _has_large_calls(self, endpoint: int) -> bool:
        return any(owner == endpoint for owner, _ in self._large_calls)

    def _large_call_is_gone(self, endpoint: int) -> None:
        if endpoint in self._behind_calls and not self._has_large_calls(endpoint):
            self._calls.append(self._behind_calls.pop(endpoint))

    def drop_call(self, key: tuple[int, int]) -> bool:
        """Take a large call back; False if it is not there any more, because it has left whole."""
        queue = self._large_calls.pop(key, None)
        if queue is None:
            return False
        self.urgent_bytes -= queue.control_bytes
        self.bulk_bytes -= queue.bulk_bytes
        abort = queue.discard(self._transfers)
        if abort is not None:
            self.put_control(abort)
        self._large_call_is_gone(key[0])
        return True

    def cancel_calls(self, endpoint: int, calls: Sequence[int]) -> None:
        """Take back the large ones of these calls that have not left whole; send CANCEL for the others."""
        left = [call for call in calls if not self.drop_call((endpoint, call))]
        for start in range(0, len(left), limits.MAX_CALLS_PER_FRAME):
            part = tuple(left[start : start + limits.MAX_CALLS_PER_FRAME])
            self.put_calls(encode(Cancel(endpoint, part)))

    def enqueue(self, queue: PublisherQueue, item: Batch | Replay | bytes, *, first: bool = False) -> None:
        """Queue a run, or what must stay in order with it, in its lane.

        With `first` it goes before everything in the lane that has not begun to leave.
        """
        put = queue.put_front if first else queue.put
        if isinstance(item, Batch):
            put(item)
            self._touched.append(queue)
        else:
            control, bulk = queue.control_bytes, queue.bulk_bytes
            put(item)
            self.ordered_bytes += queue.control_bytes - control
            self.bulk_bytes += queue.bulk_bytes - bulk
        self._schedule(queue)

    def discard_queue(self, queue: PublisherQueue) -> int:
        """Take back everything that waits in a lane; return how many messages that were."""
        pending = queue.pending
        self.ordered_bytes -= queue.control_bytes
        self.bulk_bytes -= queue.bulk_bytes
        abort = queue.discard(self._transfers)
        self._recount(queue)
        if abort is not None:
            self.put_control(abort)
        return pending

    def reschedule(self, queue: PublisherQueue) -> None:
        """Look at a lane again after its credit or its link has changed."""
        self._schedule(queue)

    def _schedule(self, queue: PublisherQueue) -> None:
        if not queue.scheduled and queue.sendable:
            queue.scheduled = True
            self._ready.append(queue)

    def take(self, room: int) -> tuple[list[Buffer], int]:
        """Return the next encoded frames to write, and their size: `room` bytes or a frame more.

        Less than `room` means that nothing else may go now.
        """
        parts: list[Buffer] = []
        size = 0
        while size < room:
            urgent = self._control or self._calls
            if urgent:
                raw = urgent.popleft()
                self.urgent_bytes -= len(raw)
                parts.append(raw)
                size += len(raw)
                continue
            if not self._ready or not (taken := self._next_of_queues(parts)):
                break
            size += taken
        return parts, size

    @property
    def has_more(self) -> bool:
        """Whether lanes wait for their turn: when `take` finds nothing, only those of large messages do."""
        return bool(self._ready)

    def _next_of_queues(self, parts: list[Buffer]) -> int:
        """Append the next frame of the lane whose turn it is; return its size, 0 if none may go now."""
        for _ in range(len(self._ready)):
            queue = self._ready.popleft()
            if self.large_budget <= 0 and queue.is_large:
                self._ready.append(queue)
                continue
            queue.scheduled = False
            if not queue.sendable:
                continue
            before, bulk, count = queue.control_bytes, queue.bulk_bytes, len(parts)
            size = queue.next_piece(self._transfers, parts)
            if len(parts) - count > 1:  # the head and the payload of a fragment
                self.large_budget -= size
            if queue.counted_bytes:
                self._recount(queue)
            if queue.control_bytes != before:
                self.bulk_bytes -= bulk - queue.bulk_bytes
                self._control_has_left(queue, before - queue.control_bytes)
            self._schedule(queue)
            if size:
                return size
        return 0

    def _control_has_left(self, queue: PublisherQueue, size: int) -> None:
        if not isinstance(queue, _LargeCall):
            self.ordered_bytes -= size
            return
        self.urgent_bytes -= size
        if queue.key is not None and self._large_calls.get(queue.key) is queue:
            del self._large_calls[queue.key]
            self._large_call_is_gone(queue.key[0])

    def trim(self) -> None:
        """Bring the lanes that got runs back to their depth: what is left in them cannot leave now.

        If all lanes together hold too much, the oldest runs of the fullest ones go. If `held_bytes` is above
        `max_held_bytes` even then, nothing is left that may be dropped: the owner must end the link.
        """
        for queue in self._touched:
            dropped = queue.dropped
            queue.trim()
            if queue.dropped != dropped:
                self.dropped += queue.dropped - dropped
                self._schedule(queue)  # what stood behind messages without credit may go now
            if queue.pending or queue.counted_bytes:
                self._recount(queue)
        self._touched.clear()
        if self.held_bytes > self.max_held_bytes:
            self._make_room()

    def _recount(self, queue: PublisherQueue) -> None:
        held = queue.held_bytes
        self.held_bytes += held - queue.counted_bytes
        queue.counted_bytes = held

    def _make_room(self) -> None:
        """Drop the oldest runs of the fullest KEEP_LAST lanes, to below the ceiling.

        So far below that the next look at all lanes is a good part of the ceiling away.
        """
        enough = self.max_held_bytes - self.max_held_bytes // 8
        fullest = [
            (-queue.held_bytes, number, queue)
            for number, queue in enumerate(self._ready)
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
