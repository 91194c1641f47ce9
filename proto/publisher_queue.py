"""A lane: one publisher's queue on one link. Its depth and its credit hold exactly, whatever its runs are.

Messages travel in runs, and depth and credit count messages: so what must go is cut out of the oldest run,
and what may leave is cut off.
"""

from __future__ import annotations

from collections import deque
from itertools import chain
from typing import cast

from proto import limits
from proto.batches import fitting_stop, message_bytes, slice_batch, with_publisher
from proto.codec import encode
from proto.fragments import Transfer, is_large
from proto.frames import Abort, Batch, Buffer, Replay


class PublisherQueue:
    """The unsent messages of one publisher on one link.

    Attributes:
        publisher: The id its runs carry on this link; runs queued under an earlier id are rewritten. With 0
            each run keeps its own.
        depth: Messages kept while they cannot leave; None keeps all.
        pending: Messages that wait; one that has begun to leave does not count.
        pending_bytes: What holding them takes: dropped messages count until their whole run is gone.
        control_bytes: Bytes of other frames that wait in order with the runs; they are never dropped.
        bulk_bytes: Those of them that are latched messages or large.
        sent: Messages that have left whole: handed to the transport.
        dropped: Messages dropped so far, because the link was slower than the publisher.
        dropped_for_bytes: Those of them that the depth had room for, and a byte ceiling had not.
        new_from: Messages below this number have left on an earlier link: they are in here to be sent again.
        abandoned: Messages that waited when they were discarded and are not lost: nobody wanted them any
            more, or they had left before.
        lost_on_break: Messages that could not leave because the link had ended.
        sent_bytes: Bytes of messages that have left on this link; what `byte_limit` is compared with.
        sequence_limit, byte_limit: Credit; None is unlimited.
        scheduled: Whether it waits for its turn; the outbox's.
        counted_bytes: What it counts for in its outbox's `held_bytes`; the outbox's.
    """

    __slots__ = (
        "_batches",
        "_front",
        "_leaving",
        "_next_sequence",
        "_queue",
        "_skip",
        "_transfer",
        "abandoned",
        "bulk_bytes",
        "byte_limit",
        "control_bytes",
        "counted_bytes",
        "depth",
        "dropped",
        "dropped_for_bytes",
        "lost_on_break",
        "new_from",
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
        self.bulk_bytes = 0
        self.sent: int = 0
        self.dropped: int = 0
        self.dropped_for_bytes: int = 0
        self.new_from: int = 0
        self.abandoned: int = 0
        self.lost_on_break: int = 0
        self.sent_bytes = 0
        self.sequence_limit: int | None = None
        self.byte_limit: int | None = None
        self.scheduled = False
        self.counted_bytes = 0
        self._front: deque[Replay | bytes] = deque()
        """Frames that stood before dropped messages: they go first, and no later drop has to pass them."""
        self._queue: deque[Batch | Replay | bytes] = deque()
        self._batches = 0
        """How many in the queue are runs."""
        self._skip = 0
        """Messages of the first run in the queue that are dropped."""
        self._leaving: Batch | Replay | bytes | None = None
        """The item whose fragments are on their way; it is not in the queue any more."""
        self._transfer: Transfer | None = None
        self._next_sequence: int | None = None
        """The number after the last message that has left on this link; before that, the one declared."""

    def put(self, item: Batch | Replay | bytes) -> None:
        """Queue a run, or something else that must stay behind the runs before it.

        That is latched messages, which are encoded when they leave, or an encoded frame.
        """
        self._queue.append(item)
        if isinstance(item, Batch):
            self._batches += 1
            self.pending += item.length
            self.pending_bytes += message_bytes(item)
            if self._next_sequence is None:
                self._next_sequence = item.first_sequence
        else:
            self._count_control(item, 1)

    def put_front(self, item: Batch | Replay | bytes) -> None:
        """Queue something before everything that has not begun to leave.

        A run only before anything has left, and before a control frame was put in; that at any time.
        """
        if not isinstance(item, Batch):
            self._count_control(item, 1)
            self._front.appendleft(item)
            return
        assert not self._front
        self._cut_skipped()
        self._batches += 1
        self.pending += item.length
        self.pending_bytes += message_bytes(item)
        if self._next_sequence is None or item.first_sequence < self._next_sequence:
            self._next_sequence = item.first_sequence
        self._queue.appendleft(item)

    def _count_control(self, item: Replay | bytes, change: int) -> None:
        size = change * (len(item.payload) if isinstance(item, Replay) else len(item))
        self.control_bytes += size
        if isinstance(item, Replay) or is_large(item):
            self.bulk_bytes += size

    @property
    def first_sequence(self) -> int | None:
        """The number of the oldest message that has not left whole, or None."""
        if isinstance(self._leaving, Batch):
            return self._leaving.first_sequence
        for item in self._queue:
            if isinstance(item, Batch):
                return item.first_sequence + self._skip
        return None

    @property
    def held_bytes(self) -> int:
        """What the queued runs take of memory, about: the messages, and what each run takes beside them.

        Other frames count in `control_bytes` only. No `trim` looks at a lane that gets one, so what they take
        would be noticed when the lane has its turn, and nobody looks at the ceiling then.
        """
        return self.pending_bytes + limits.BATCH_OVERHEAD_BYTES * self._batches

    def trim(self) -> None:
        """Drop the oldest messages beyond the depth (and the byte ceiling, but never the last message).

        Other frames keep their place between the runs that stay.
        """
        if self.depth is None or (
            self.pending <= self.depth and self.pending_bytes <= limits.MAX_QUEUE_BYTES
        ):
            return
        while self.pending > self.depth:
            self._drop_first(self.pending - self.depth)
        while self.pending_bytes > limits.MAX_QUEUE_BYTES and self.pending > 1:
            self.dropped_for_bytes += self._drop_first(self.pending - 1)

    def drop_oldest_batch(self) -> int:
        """Drop the oldest run to make room on the link, but not the last message. Needs `pending` > 1.

        Returns:
            How many messages that were.
        """
        gone = self._drop_first(self.pending - 1)
        self.dropped_for_bytes += gone
        return gone

    def _drop_first(self, most: int) -> int:
        """Drop at most `most` messages of the first run; return how many. Needs a run in the queue.

        Those that had left before are not lost by that.
        """
        while not isinstance(head := self._queue.popleft(), Batch):
            self._front.append(head)
        left = head.length - self._skip
        gone = min(left, most)
        again = min(gone, max(0, self.new_from - head.first_sequence - self._skip))
        self.pending -= gone
        self.dropped += gone - again
        self.abandoned += again
        if gone == left:
            self._batches -= 1
            self.pending_bytes -= message_bytes(head)
            self._skip = 0
        else:
            self._skip += gone
            self._queue.appendleft(head)
        return gone

    def _cut_skipped(self) -> None:
        """Take the dropped messages out of the first run, so that its place does not matter."""
        if not self._skip:
            return
        where = next(index for index, item in enumerate(self._queue) if isinstance(item, Batch))
        whole = cast("Batch", self._queue[where])
        rest = slice_batch(whole, self._skip, whole.length)
        self.pending_bytes -= message_bytes(whole) - message_bytes(rest)
        self._queue[where] = rest
        self._skip = 0

    @property
    def sendable(self) -> bool:
        """Whether the next item may go now: there is one, and credit allows it."""
        if self._leaving is not None or self._front:
            return True
        if not self._queue:
            return False
        if not isinstance(self._queue[0], Batch):
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
        head = next(chain(self._front, self._queue), b"")
        if isinstance(head, Replay):
            return is_large(head.payload)
        return is_large(head.raw if isinstance(head, Batch) else head)

    @property
    def leaving(self) -> int:
        """Messages that have begun to leave and are not gone whole: some of their fragments are."""
        return self._leaving.length if isinstance(self._leaving, Batch) else 0

    @property
    def unsent(self) -> int:
        """Messages that have never left: those that wait, and those dropped before."""
        first = self.first_sequence
        again = 0 if first is None else min(self.pending, max(0, self.new_from - first))
        return self.pending + self.leaving - again + self.dropped

    @property
    def empty(self) -> bool:
        """Whether everything put in has left."""
        return not self._queue and not self._front and self._leaving is None

    def _prepare(self) -> Buffer:
        """Make the head of the queue exactly what may leave now and return its encoded frame."""
        head = self._front[0] if self._front else self._queue[0]
        if not isinstance(head, Batch):
            return encode(head) if isinstance(head, Replay) else head
        start, stop = self._skip, head.length
        if self.sequence_limit is not None:
            stop = min(stop, max(self.sequence_limit - head.first_sequence, start + 1))
        if self.byte_limit is not None:
            stop = min(stop, fitting_stop(head, start, self.byte_limit - self.sent_bytes))
        batch = slice_batch(head, start, stop)
        if self.publisher:
            batch = with_publisher(batch, self.publisher)
        if batch is not head:
            self._queue.popleft()
            self.pending_bytes -= message_bytes(head) - message_bytes(batch)
            if stop < head.length:
                rest = slice_batch(head, stop, head.length)
                self._batches += 1
                self.pending_bytes += message_bytes(rest)
                self._queue.appendleft(rest)
            self._queue.appendleft(batch)
            self._skip = 0
        return batch.raw

    def _start_leaving(self) -> None:
        item = self._leaving = self._front.popleft() if self._front else self._queue.popleft()
        if isinstance(item, Batch):
            self._batches -= 1
            self.pending -= item.length
            self.pending_bytes -= message_bytes(item)

    def _has_left(self) -> None:
        item = self._leaving
        self._leaving = self._transfer = None
        if isinstance(item, Batch):
            self.sent += item.length
            self.sent_bytes += message_bytes(item)
            self._next_sequence = item.first_sequence + item.length
        elif item is not None:
            self._count_control(item, -1)

    def next_piece(self, transfers: Transfers, parts: list[Buffer]) -> int:
        """Append the next frame to send to `parts`; return its size, or 0 when no transfer may start now.

        Needs `sendable`.
        """
        if self._transfer is None:
            if transfers.full and self.is_large:  # not encoded in vain, again and again
                return 0
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

        Control frames go: the ids in them are the old link's. So do messages that waited to be sent again:
        whoever wants that on the new link, too, puts them in front anew. `next_sequence` is the number that
        the new link has been told of; what has been dropped since then uses no credit up.
        """
        if self._next_sequence is not None:
            self.new_from = max(self.new_from, self._next_sequence)
        self._cut_skipped()
        if isinstance(self._leaving, Batch):
            self._batches += 1
            self.pending += self._leaving.length
            self.pending_bytes += message_bytes(self._leaving)
            self._queue.appendleft(self._leaving)
        self._front.clear()
        self._queue = deque(item for item in self._queue if isinstance(item, Batch))
        self._leaving = self._transfer = None
        while (first := self.first_sequence) is not None and first < self.new_from:
            self._drop_first(self.new_from - first)
        self._next_sequence = self.first_sequence if next_sequence is None else next_sequence
        self.publisher = publisher
        self.sent_bytes = 0
        self.control_bytes = self.bulk_bytes = 0
        self.sequence_limit = None
        self.byte_limit = None
        self.scheduled = False
        self.counted_bytes = 0

    def drop_larger(self, most: int) -> int:
        """Drop the runs with more than `most` bytes of messages; return how many messages that were.

        Only before anything has left.
        """
        self._cut_skipped()
        before = self.dropped
        kept: deque[Batch | Replay | bytes] = deque()
        for item in self._queue:
            if isinstance(item, Batch) and message_bytes(item) > most:
                self._batches -= 1
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

    def mark_lost(self, batch: Batch | None = None) -> None:
        """Count what cannot leave, as the link has ended: this run, or without one everything that waits."""
        if batch is not None:
            self.lost_on_break += batch.length
            return
        self.lost_on_break += self.pending + self.leaving
        self._clear()

    def _clear(self) -> None:
        self._front.clear()
        self._queue.clear()
        self._leaving = self._transfer = None
        self.pending = self.pending_bytes = self.control_bytes = self.bulk_bytes = self._skip = (
            self._batches
        ) = 0


class Transfers:
    """The fragmented frames under way on one link: how many, and their ids.

    `full` says whether there may be no more.
    """

    __slots__ = ("_next_id", "_open", "full")

    def __init__(self) -> None:
        self.full = False
        self._next_id = 0
        self._open: set[int] = set()

    def start(self, raw: Buffer) -> Transfer | None:
        """Begin a transfer, unless as many as allowed are under way."""
        if self.full:
            return None
        self._next_id = (self._next_id + 1) & limits.MAX_U32
        while self._next_id in self._open:
            self._next_id = (self._next_id + 1) & limits.MAX_U32
        self._open.add(self._next_id)
        self.full = len(self._open) >= limits.MAX_TRANSFERS
        return Transfer(self._next_id, raw)

    def end(self, transfer: Transfer) -> None:
        """A transfer is over."""
        self._open.discard(transfer.id)
        self.full = False
