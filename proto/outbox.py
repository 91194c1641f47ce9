"""What waits to be sent on one link, and in which order it goes. Pure: whoever owns a socket pulls from it.

Control frames go first, then requests and replies, then the *lanes* in turn. A lane is one publisher's queue:
its depth bounds the messages in it, exactly, by dropping the oldest when they cannot leave; its credit, where
it has one, holds them back. Large frames leave in fragments, one at each turn of their lane, so they hold up
nobody.
"""

from __future__ import annotations

import sys
from collections import deque
from typing import TYPE_CHECKING, cast

from proto import limits
from proto.codec import encode
from proto.fragments import Transfer, is_large
from proto.frames import Abort, Buffer, Cancel, Run
from proto.runs import cut, fitting, message_bytes, readdress

if TYPE_CHECKING:
    from collections.abc import Sequence


class Lane:
    """The unsent messages of one publisher on one link.

    Attributes:
        publisher: The id its runs carry on this link; runs queued under an earlier id are rewritten. With 0
            each run keeps its own.
        depth: Messages kept while they cannot leave; None keeps all.
        pending: Messages that wait; one that has begun to leave does not count.
        pending_bytes: What holding them takes: dropped messages count until their whole run is gone.
        control_bytes: Bytes of other frames that wait in order with the runs; they are never dropped.
        sent: Messages that have left whole: handed to the transport.
        dropped: Messages dropped so far, because the link was slower than the publisher.
        abandoned: Messages that waited when they were discarded: nobody wanted them any more.
        lost_on_break: Messages that could not leave because the link had ended.
        sent_bytes: Bytes of messages that have left on this link; what `byte_limit` is compared with.
        sequence_limit, byte_limit: Credit; None is unlimited.
    """

    __slots__ = (
        "_leaving",
        "_next_sequence",
        "_queue",
        "_skip",
        "_transfer",
        "abandoned",
        "byte_limit",
        "control_bytes",
        "depth",
        "dropped",
        "lost_on_break",
        "pending",
        "pending_bytes",
        "publisher",
        "scheduled",
        "sent",
        "sent_bytes",
        "sequence_limit",
    )

    def __init__(self, publisher: int, depth: int | None) -> None:
        self.publisher = publisher
        self.depth = depth
        self.pending: int = 0
        self.pending_bytes: int = 0
        self.control_bytes = 0
        self.sent: int = 0
        self.dropped: int = 0
        self.abandoned: int = 0
        self.lost_on_break: int = 0
        self.sent_bytes = 0
        self.sequence_limit: int | None = None
        self.byte_limit: int | None = None
        self.scheduled = False
        self._queue: deque[Run | bytes] = deque()
        self._skip = 0
        """Messages of the first run in the queue that are dropped."""
        self._leaving: Run | bytes | None = None
        """The item whose fragments are on their way; it is not in the queue any more."""
        self._transfer: Transfer | None = None
        self._next_sequence: int | None = None
        """The number after the last message that has left on this link; before that, the one declared."""

    def put(self, item: Run | bytes) -> None:
        """Queue a run, or an encoded control frame that must stay behind the runs before it."""
        self._queue.append(item)
        if isinstance(item, Run):
            self.pending += item.length
            self.pending_bytes += message_bytes(item)
            if self._next_sequence is None:
                self._next_sequence = item.first_sequence
        else:
            self.control_bytes += len(item)

    def put_front(self, item: Run | bytes) -> None:
        """Queue something before everything that has not begun to leave.

        A run only before anything has left on this link; a control frame at any time.
        """
        if isinstance(item, Run):
            self._cut_skipped()
            self.pending += item.length
            self.pending_bytes += message_bytes(item)
            if self._next_sequence is None or item.first_sequence < self._next_sequence:
                self._next_sequence = item.first_sequence
        else:
            self.control_bytes += len(item)
        self._queue.appendleft(item)

    @property
    def first_sequence(self) -> int | None:
        """The number of the oldest message that has not left whole, or None."""
        if isinstance(self._leaving, Run):
            return self._leaving.first_sequence
        for item in self._queue:
            if isinstance(item, Run):
                return item.first_sequence + self._skip
        return None

    def trim(self) -> None:
        """Drop the oldest messages beyond the depth (and the byte ceiling, but never the last message).

        Control frames keep their place between the runs that stay.
        """
        if self.depth is None or (self.pending <= self.depth and self.pending_bytes <= limits.LANE_BYTES):
            return
        kept: list[bytes] = []
        while self.pending > self.depth or (self.pending_bytes > limits.LANE_BYTES and self.pending > 1):
            head = self._queue.popleft()
            if not isinstance(head, Run):
                kept.append(head)
                continue
            left = head.length - self._skip
            gone = min(left, self.pending - (self.depth if self.pending > self.depth else 1))
            self.pending -= gone
            self.dropped += gone
            if gone == left:
                self.pending_bytes -= message_bytes(head)
                self._skip = 0
            else:
                self._skip += gone
                self._queue.appendleft(head)
        self._queue.extendleft(reversed(kept))

    def _cut_skipped(self) -> None:
        """Take the dropped messages out of the first run, so that its place does not matter."""
        if not self._skip:
            return
        where = next(index for index, item in enumerate(self._queue) if isinstance(item, Run))
        whole = cast("Run", self._queue[where])
        rest = cut(whole, self._skip, whole.length)
        self.pending_bytes -= message_bytes(whole) - message_bytes(rest)
        self._queue[where] = rest
        self._skip = 0

    @property
    def sendable(self) -> bool:
        """Whether the next item may go now: there is one, and credit allows it."""
        if self._leaving is not None:
            return True
        if not self._queue:
            return False
        if not isinstance(self._queue[0], Run):
            return True
        # Not the waiting message's own number: behind a gap of dropped ones it may be beyond every limit
        # that a reader who has not seen the gap will ever grant.
        if self.sequence_limit is not None and cast("int", self._next_sequence) >= self.sequence_limit:
            return False
        return self.byte_limit is None or self.sent_bytes < self.byte_limit

    @property
    def is_large(self) -> bool:
        """Whether what is next is a large message, or a piece of one."""
        if self._transfer is not None:
            return True
        head = self._queue[0] if self._queue else b""
        return is_large(head.raw if isinstance(head, Run) else head)

    @property
    def leaving(self) -> int:
        """Messages that have begun to leave and are not gone whole: some of their fragments are."""
        return self._leaving.length if isinstance(self._leaving, Run) else 0

    @property
    def empty(self) -> bool:
        """Whether everything put in has left."""
        return not self._queue and self._leaving is None

    def _prepare(self) -> Buffer:
        """Make the head of the queue exactly what may leave now and return its encoded frame."""
        head = self._queue[0]
        if not isinstance(head, Run):
            return head
        start, stop = self._skip, head.length
        if self.sequence_limit is not None:
            stop = min(stop, max(self.sequence_limit - head.first_sequence, start + 1))
        if self.byte_limit is not None:
            stop = min(stop, fitting(head, start, self.byte_limit - self.sent_bytes))
        run = cut(head, start, stop)
        if self.publisher:
            run = readdress(run, self.publisher)
        if run is not head:
            self._queue.popleft()
            self.pending_bytes -= message_bytes(head) - message_bytes(run)
            if stop < head.length:
                rest = cut(head, stop, head.length)
                self.pending_bytes += message_bytes(rest)
                self._queue.appendleft(rest)
            self._queue.appendleft(run)
            self._skip = 0
        return run.raw

    def _start_leaving(self) -> None:
        item = self._leaving = self._queue.popleft()
        if isinstance(item, Run):
            self.pending -= item.length
            self.pending_bytes -= message_bytes(item)

    def _has_left(self) -> None:
        item = self._leaving
        self._leaving = self._transfer = None
        if isinstance(item, Run):
            self.sent += item.length
            self.sent_bytes += message_bytes(item)
            self._next_sequence = item.first_sequence + item.length
        elif item is not None:
            self.control_bytes -= len(item)

    def next_piece(self, transfers: Transfers, parts: list[Buffer]) -> int:
        """Append the next frame to send to `parts`; return its size, or 0 when no transfer may start now.

        Needs `sendable`.
        """
        if self._transfer is None:
            raw = self._prepare()
            if is_large(raw):
                self._transfer = transfers.start(raw)
                if self._transfer is None:
                    return 0
            self._start_leaving()
            if self._transfer is None:
                self._has_left()
                parts.append(raw)
                return len(raw)
        head, payload, last = self._transfer.next()
        if last:
            transfers.end(self._transfer)
            self._has_left()
        parts += (head, payload)
        return len(head) + len(payload)

    def restart(self, publisher: int, next_sequence: int | None = None) -> None:
        """Prepare for a new link: another publisher id, no credit yet, half-sent messages whole again.

        Control frames go: the ids in them are the old link's. `next_sequence` is the number that the new link
        has been told of; what has been dropped since then uses no credit up.
        """
        self._cut_skipped()
        if isinstance(self._leaving, Run):
            self.pending += self._leaving.length
            self.pending_bytes += message_bytes(self._leaving)
            self._queue.appendleft(self._leaving)
        self._queue = deque(item for item in self._queue if isinstance(item, Run))
        self._leaving = self._transfer = None
        self._next_sequence = self.first_sequence if next_sequence is None else next_sequence
        self.publisher = publisher
        self.sent_bytes = 0
        self.control_bytes = 0
        self.sequence_limit = None
        self.byte_limit = None
        self.scheduled = False

    def drop_larger(self, most: int) -> int:
        """Drop the runs with more than `most` bytes of messages; return how many messages that were.

        Only before anything has left.
        """
        self._cut_skipped()
        before = self.dropped
        kept: deque[Run | bytes] = deque()
        for item in self._queue:
            if isinstance(item, Run) and message_bytes(item) > most:
                self.pending -= item.length
                self.pending_bytes -= message_bytes(item)
                self.dropped += item.length
            else:
                kept.append(item)
        self._queue = kept
        return self.dropped - before

    def discard(self, transfers: Transfers) -> bytes | None:
        """Drop everything, as nobody wants it; return the ABORT for a transfer that had begun."""
        self.abandoned += self.pending + self.leaving
        transfer = self._transfer
        self._clear()
        if transfer is None:
            return None
        transfers.end(transfer)
        return encode(Abort(transfer.id))

    def lose(self, run: Run | None = None) -> None:
        """Count what cannot leave, as the link has ended: this run, or without one everything that waits."""
        if run is not None:
            self.lost_on_break += run.length
            return
        self.lost_on_break += self.pending + self.leaving
        self._clear()

    def _clear(self) -> None:
        self._queue.clear()
        self._leaving = self._transfer = None
        self.pending = self.pending_bytes = self.control_bytes = self._skip = 0


class _LargeCall(Lane):
    """A lane of its own for one large frame of requests or replies."""

    __slots__ = ("key",)

    def __init__(self, raw: bytes, key: tuple[int, int] | None) -> None:
        super().__init__(0, None)
        self.key = key
        self.put(raw)


class Transfers:
    """The fragmented frames under way on one link: how many, and their ids."""

    __slots__ = ("_next_id", "_open")

    def __init__(self) -> None:
        self._next_id = 0
        self._open: set[int] = set()

    def start(self, raw: Buffer) -> Transfer | None:
        """Begin a transfer, unless as many as allowed are under way."""
        if len(self._open) >= limits.MAX_TRANSFERS:
            return None
        self._next_id = (self._next_id + 1) & limits.MAX_U32
        while self._next_id in self._open:
            self._next_id = (self._next_id + 1) & limits.MAX_U32
        self._open.add(self._next_id)
        return Transfer(self._next_id, raw)

    def end(self, transfer: Transfer) -> None:
        """A transfer is over."""
        self._open.discard(transfer.id)


class Outbox:
    """Everything that waits on one link.

    The owner puts things in, calls `next` until it gets None or its transport is full, and then `trim`: so
    only what cannot leave is dropped.

    Attributes:
        large_room: Bytes of large messages that may still leave before others get a turn; the owner sets it.
        urgent_bytes: Bytes of control frames and calls that wait.
        ordered_bytes: Bytes of control frames (REPLAY among them) that wait in lanes, in order with runs.

    Neither kind is ever dropped, so the owner caps both.
    """

    __slots__ = (
        "_calls",
        "_control",
        "_large_calls",
        "_ready",
        "_touched",
        "_transfers",
        "large_room",
        "ordered_bytes",
        "urgent_bytes",
    )

    def __init__(self) -> None:
        self._control: deque[bytes] = deque()
        self._calls: deque[bytes] = deque()
        self._ready: deque[Lane] = deque()
        self._touched: list[Lane] = []
        self._large_calls: dict[tuple[int, int], _LargeCall] = {}
        self._transfers = Transfers()
        self.large_room = sys.maxsize
        self.urgent_bytes = 0
        self.ordered_bytes = 0

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
        lane = _LargeCall(raw, key)
        if key is not None:
            self._large_calls[key] = lane
        self._schedule(lane)

    def drop_call(self, key: tuple[int, int]) -> bool:
        """Take a large call back; False if it is not there any more, because it has left whole."""
        lane = self._large_calls.pop(key, None)
        if lane is None:
            return False
        self.urgent_bytes -= lane.control_bytes
        abort = lane.discard(self._transfers)
        if abort is not None:
            self.put_control(abort)
        return True

    def cancel_calls(self, endpoint: int, calls: Sequence[int]) -> None:
        """Take back the large ones of these calls that have not left whole; send CANCEL for the others."""
        left = [call for call in calls if not self.drop_call((endpoint, call))]
        for start in range(0, len(left), limits.MAX_CALLS_PER_FRAME):
            part = tuple(left[start : start + limits.MAX_CALLS_PER_FRAME])
            self.put_calls(encode(Cancel(endpoint, part)))

    def put_lane(self, lane: Lane, item: Run | bytes, *, first: bool = False) -> None:
        """Queue a run, or a control frame that must stay in order with it, in its lane.

        With `first` it goes before everything in the lane that has not begun to leave.
        """
        if first:
            lane.put_front(item)
        else:
            lane.put(item)
        if isinstance(item, Run):
            self._touched.append(lane)
        else:
            self.ordered_bytes += len(item)
        self._schedule(lane)

    def drop_lane(self, lane: Lane) -> int:
        """Take back everything that waits in a lane; return how many messages that were."""
        pending = lane.pending
        self.ordered_bytes -= lane.control_bytes
        abort = lane.discard(self._transfers)
        if abort is not None:
            self.put_control(abort)
        return pending

    def wake(self, lane: Lane) -> None:
        """Look at a lane again after its credit or its link has changed."""
        self._schedule(lane)

    def _schedule(self, lane: Lane) -> None:
        if not lane.scheduled and lane.sendable:
            lane.scheduled = True
            self._ready.append(lane)

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
            if not self._ready or not (taken := self._next_of_lanes(parts)):
                break
            size += taken
        return parts, size

    @property
    def has_more(self) -> bool:
        """Whether lanes wait for their turn: when `take` finds nothing, only those of large messages do."""
        return bool(self._ready)

    def _next_of_lanes(self, parts: list[Buffer]) -> int:
        """Append the next frame of the lane whose turn it is; return its size, 0 if none may go now."""
        for _ in range(len(self._ready)):
            lane = self._ready.popleft()
            if self.large_room <= 0 and lane.is_large:
                self._ready.append(lane)
                continue
            lane.scheduled = False
            if not lane.sendable:
                continue
            before, count = lane.control_bytes, len(parts)
            size = lane.next_piece(self._transfers, parts)
            if len(parts) - count > 1:  # the head and the payload of a fragment
                self.large_room -= size
            if lane.control_bytes != before:
                self._control_has_left(lane, before - lane.control_bytes)
            self._schedule(lane)
            if size:
                return size
        return 0

    def _control_has_left(self, lane: Lane, size: int) -> None:
        if not isinstance(lane, _LargeCall):
            self.ordered_bytes -= size
            return
        self.urgent_bytes -= size
        if lane.key is not None and self._large_calls.get(lane.key) is lane:
            del self._large_calls[lane.key]

    def trim(self) -> None:
        """Bring the lanes that got runs back to their depth: what is left in them cannot leave now."""
        for lane in self._touched:
            dropped = lane.dropped
            lane.trim()
            if lane.dropped != dropped:
                self._schedule(lane)  # what stood behind messages without credit may go now
        self._touched.clear()
