"""The send queue of one publisher on one link: what waits, what is dropped, what may be sent, and when.

Five rules hold at every moment:

- **Depth.** Of the messages that cannot be sent, the newest `depth` are kept. The owner first sends what the
  transport takes and then calls `trim`, so a fast link drops nothing. Messages travel in batches, but depth
  counts messages: a drop may only mark the first messages of the oldest batch as skipped. They are cut off
  when that batch is sent or moved: cutting copies, and a batch that has lost one message soon loses more.
- **Credit.** A message is sent only below `sequence_limit` and `byte_limit`. A batch that reaches beyond a
  limit is cut: its first part is sent, the rest waits.
- **Order.** Messages are sent in the order of their numbers. Frames that refer to them (ATTACHED, DETACHED,
  REPLAY, UNDECLARE) are queued between them and never overtake them.
- **Large frames.** A frame above `limits.MAX_FRAME_BYTES` is sent in fragments, one each time the outbox
  serves the queue. Meanwhile its messages count as `leaving`, no longer as `pending`.
- **Counts.** Each message that was put in is `pending`, `leaving`, `sent`, `dropped`, `abandoned` or
  `lost_on_break`, exactly once. What waits is counted in `_count`, and nowhere else.

A batch in shared memory (`references.py`) is sent by reference to a peer that can read it, and to any other
as bytes, message by message: together they may be much more than a frame.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from dataclasses import dataclass, field
from itertools import chain
from typing import TYPE_CHECKING, TypeAlias, cast

from proto import limits
from proto.queues.batches import attributes_bytes, fitting_stop, message_bytes, slice_batch, with_publisher
from proto.wire.codec import encode, encode_head
from proto.wire.fragments import is_large, is_large_size
from proto.wire.frames import Abort, Batch, Buffer, Replay
from proto.wire.references import MIN_REFERENCE_BYTES, SharedBatch, bytes_head

if TYPE_CHECKING:
    from proto.wire.fragments import Transfer, Transfers


class ReplaySource(ABC):
    """Latched messages that are taken from where they are kept only when they can be sent."""

    __slots__ = ()

    @abstractmethod
    def next_bytes(self) -> int:
        """Return the size of the next latched batch; 0 without one."""

    @abstractmethod
    def pop(self) -> Replay:
        """Return the next latched batch. Needs `next_bytes` > 0."""


Ordered: TypeAlias = ReplaySource | Replay | bytes
"""Anything but a batch that waits in order with batches."""


@dataclass(slots=True, eq=False, repr=False)
class PublisherQueue:
    """The unsent messages of one publisher on one link, its credit, and the batch being sent.

    Its owner puts batches in through the link's outbox, which alone takes frames out. A publisher that comes
    back may resume the queue that it left, so the queue outlives links (`restart`) and even its publisher.
    """

    publisher: int
    """The id that its batches carry on this link; batches queued under another id are rewritten. With 0 each
    batch keeps its own."""
    depth: int | None
    """Messages to keep when they cannot be sent; None keeps all."""
    pending: int = field(default=0, init=False)
    """Messages that wait, without those of a batch that is being sent."""
    pending_bytes: int = field(default=0, init=False)
    """Their size. Skipped messages count until their batch is cut or removed."""
    control_bytes: int = field(default=0, init=False)
    """Estimated memory of other frames that wait in order with the batches; they are never dropped."""
    bulk_bytes: int = field(default=0, init=False)
    """The part of `control_bytes` that is latched messages or large frames."""
    sent: int = field(default=0, init=False)
    """Messages handed to the transport completely."""
    sent_bytes: int = field(default=0, init=False)
    """Bytes of messages sent on this link, for comparison with `byte_limit`."""
    dropped: int = field(default=0, init=False)
    """Messages dropped so far because the link was slower than the publisher."""
    dropped_for_bytes: int = field(default=0, init=False)
    """Those of them that fitted the depth but not a limit in bytes."""
    abandoned: int = field(default=0, init=False)
    """Messages discarded without loss: no subscription needed them any more, or they had been sent before."""
    lost_on_break: int = field(default=0, init=False)
    """Messages that could not be sent because the link had ended."""
    resend_below: int = field(default=0, init=False)
    """Messages with smaller numbers have been sent on an earlier link and are queued to be sent again."""
    next_sequence: int | None = field(default=None, init=False)
    """The number after the last message sent on this link; before that, the declared number, or that of the
    first message put in. None before either. Read-only for others."""
    sequence_limit: int | None = field(default=None, init=False)
    """Credit: send messages with smaller numbers only. None is unlimited."""
    byte_limit: int | None = field(default=None, init=False)
    """Credit: start a message only while `sent_bytes` is smaller. None is unlimited."""
    keeps_credit: bool = field(default=False, init=False)
    """Whether the messages that credit allows to send are kept, too, beyond the depth."""
    scheduled: bool = field(default=False, init=False)
    """Whether the outbox has it in its round; owned by the outbox."""
    blocked: bool = field(default=False, init=False)
    """Whether its first message waits until the peer has released others, which were sent by reference."""
    counted_bytes: int = field(default=0, init=False)
    """Its part of the outbox's `held_bytes`; owned by the outbox."""
    _front: deque[Ordered] = field(default_factory=deque["Ordered"], init=False)
    """Frames that preceded dropped messages. They are sent first, so that later drops need not pass them."""
    _queue: deque[Batch | Ordered] = field(default_factory=deque["Batch | Ordered"], init=False)
    _batches: int = field(default=0, init=False)
    """Number of batches in `_queue`."""
    _attributes_bytes: int = field(default=0, init=False)
    """Estimated memory of their attributes."""
    _skip: int = field(default=0, init=False)
    """Number of dropped messages at the start of the first batch in `_queue`."""
    _leaving: Batch | Ordered | None = field(default=None, init=False)
    """The item whose fragments are being sent; it is in no queue any more."""
    _transfer: Transfer | None = field(default=None, init=False)
    """The fragments of `_leaving`; set exactly while that is."""

    # What waits

    def put(self, item: Batch | Ordered) -> None:
        """Append a batch, or a frame that must follow the batches before it.

        Args:
            item: A batch, latched messages (encoded when they are sent), a source of such, or another encoded
                frame.
        """
        self._queue.append(item)
        if isinstance(item, Batch):
            self._count(item, 1)
            if self.next_sequence is None:
                self.next_sequence = item.first_sequence
        else:
            self._count_control(item, 1)

    def put_front(self, item: Batch | Ordered) -> None:
        """Insert an item before everything that is not being sent.

        Args:
            item: As for `put`. A batch is allowed only before the first message is sent on this link and
                before any other frame is inserted at the front.
        """
        if not isinstance(item, Batch):
            self._count_control(item, 1)
            self._front.appendleft(item)
            return
        assert not self._front
        self._cut_skipped()
        self._count(item, 1)
        if self.next_sequence is None or item.first_sequence < self.next_sequence:
            self.next_sequence = item.first_sequence
        self._queue.appendleft(item)

    def _count(self, batch: Batch, sign: int, skipped: int = 0) -> None:
        """Add a batch to what waits (`sign` 1), or subtract it (-1).

        Every batch that enters or leaves `_queue` passes here once, whole or cut: so the counts cannot
        disagree with the content, whatever way a batch takes.

        Args:
            batch: The batch.
            sign: 1 or -1.
            skipped: Messages at its start that have been subtracted already.
        """
        self._batches += sign
        self.pending += sign * (batch.length - skipped)
        self.pending_bytes += sign * message_bytes(batch)
        if batch.attributes is not None:
            self._attributes_bytes += sign * attributes_bytes(batch.attributes)

    def _count_control(self, item: Ordered, sign: int) -> None:
        """Add a frame to the byte counts (`sign` 1), or subtract it (-1)."""
        raw = b"" if isinstance(item, ReplaySource) else item.payload if isinstance(item, Replay) else item
        size = sign * (len(raw) + limits.FRAME_OVERHEAD_BYTES)
        self.control_bytes += size
        if isinstance(item, Replay) or is_large(raw):
            self.bulk_bytes += size

    def control_frames(self) -> list[bytes]:
        """Return the frames between the messages, without latched messages."""
        return [item for item in (*self._front, *self._queue) if isinstance(item, bytes)]

    @property
    def held_bytes(self) -> int:
        """Estimated memory of the queued batches: their messages, and overheads for batches and messages.

        Other frames count only in `control_bytes`, since nothing compares them with the limit of a link when
        they are queued.
        """
        return (
            self.pending_bytes
            + self._attributes_bytes
            + limits.BATCH_OVERHEAD_BYTES * self._batches
            + limits.MESSAGE_OVERHEAD_BYTES * self.pending
        )

    @property
    def bytes_put(self) -> int:
        """Bytes of the messages sent, being sent and waiting: `sent_bytes` when all of them are sent."""
        leaving = message_bytes(self._leaving) if isinstance(self._leaving, Batch) else 0
        return self.sent_bytes + leaving + self.pending_bytes

    @property
    def first_sequence(self) -> int | None:
        """The number of the oldest message that has not been sent completely, or None."""
        if isinstance(self._leaving, Batch):
            return self._leaving.first_sequence
        for item in self._queue:
            if isinstance(item, Batch):
                return item.first_sequence + self._skip
        return None

    @property
    def end_sequence(self) -> int:
        """The number after the last message that waits or was sent; 0 if there was none."""
        for item in reversed(self._queue):
            if isinstance(item, Batch):
                return item.first_sequence + item.length
        if isinstance(self._leaving, Batch):
            return self._leaving.first_sequence + self._leaving.length
        return self.next_sequence or 0

    @property
    def leaving(self) -> int:
        """Messages of which some fragments are sent, but not all."""
        return self._leaving.length if isinstance(self._leaving, Batch) else 0

    @property
    def unsent(self) -> int:
        """Messages that were never sent completely on any link: waiting, leaving or dropped."""
        first = self.first_sequence
        resent = 0 if first is None else min(self.pending, max(0, self.resend_below - first))
        return self.pending + self.leaving - resent + self.dropped

    @property
    def empty(self) -> bool:
        """Whether everything put in has been sent."""
        return not self._queue and not self._front and self._leaving is None

    # What is dropped

    def trim(self) -> None:
        """Drop the oldest messages beyond the depth and beyond `limits.MAX_QUEUE_BYTES`.

        The byte limit never drops the last message. Other frames keep their order.
        """
        depth = self.depth
        if depth is None or (self.pending <= depth and self.pending_bytes <= limits.MAX_QUEUE_BYTES):
            return
        most = depth + self.beyond_depth
        while self.pending > most:
            self._drop_first(self.pending - most)
        while self.pending_bytes > limits.MAX_QUEUE_BYTES and self.pending > 1:
            self.drop_oldest_batch()

    @property
    def beyond_depth(self) -> int:
        """Messages that may wait beside `depth`: with `keeps_credit`, as many as credit allows to send."""
        if not self.keeps_credit or self.sequence_limit is None or not self._has_credit:
            return 0
        return max(0, self.sequence_limit - cast("int", self.next_sequence))

    def drop_oldest_batch(self) -> int:
        """Drop the oldest batch to free memory, but never the last message. Needs `pending` > 1.

        Returns:
            The number of messages dropped.
        """
        count = self._drop_first(self.pending - 1)
        self.dropped_for_bytes += count
        return count

    def _drop_first(self, most: int) -> int:
        """Drop at most `most` messages of the first batch and return how many. Needs a batch in the queue.

        Messages that were sent on an earlier link count as abandoned, not as dropped.
        """
        while not isinstance(head := self._queue.popleft(), Batch):
            self._front.append(head)
        left = head.length - self._skip
        count = min(left, most)
        resent = min(count, max(0, self.resend_below - head.first_sequence - self._skip))
        self.dropped += count - resent
        self.abandoned += resent
        if count == left:
            self._count(head, -1, self._skip)
            self._skip = 0
        else:
            self._skip += count
            self.pending -= count
            self._queue.appendleft(head)
        return count

    def _cut_skipped(self) -> None:
        """Remove the skipped messages from the first batch, so that another batch may become the first."""
        if not self._skip:
            return
        index = next(index for index, item in enumerate(self._queue) if isinstance(item, Batch))
        whole = cast("Batch", self._queue[index])
        rest = self._queue[index] = slice_batch(whole, self._skip, whole.length)
        self._count(whole, -1, self._skip)
        self._count(rest, 1)
        self._skip = 0

    def drop_larger(self, max_bytes: int) -> int:
        """Drop the batches with more than `max_bytes` bytes of messages, before the first message is sent.

        Of a batch in shared memory only the messages that are larger are dropped: as bytes each is one batch.

        Returns:
            The number of messages dropped.
        """
        self._cut_skipped()
        before = self.dropped
        kept: deque[Batch | Ordered] = deque()
        waiting = deque(self._queue)
        while waiting:
            item = waiting.popleft()
            if not isinstance(item, Batch) or message_bytes(item) <= max_bytes:
                kept.append(item)
                continue
            self._count(item, -1)
            if isinstance(item, SharedBatch) and item.length > 1:
                parts = [slice_batch(item, index, index + 1) for index in range(item.length)]
                for part in parts:
                    self._count(part, 1)
                waiting.extendleft(reversed(parts))
            else:
                self.dropped += item.length
        self._queue = kept
        return self.dropped - before

    # What may be sent

    @property
    def sendable(self) -> bool:
        """Whether there is a next item and credit allows to send it."""
        queue = self._queue
        if not queue or self._front or self._leaving is not None:
            return bool(self._front) or self._leaving is not None
        return not self.blocked and (not isinstance(queue[0], Batch) or self._has_credit)

    @property
    def _has_credit(self) -> bool:
        """Whether credit allows to send a message now. Needs that there was one."""
        # Do not compare the waiting message's own number: after a gap of dropped messages it may exceed every
        # limit that a subscription which has not seen the gap will ever grant.
        if self.sequence_limit is not None and cast("int", self.next_sequence) >= self.sequence_limit:
            return False
        return self.byte_limit is None or self.sent_bytes < self.byte_limit

    @property
    def is_large(self) -> bool:
        """Whether the next frame is a large one or one of its fragments."""
        if self._transfer is not None:
            return True
        head = next(chain(self._front, self._queue), b"")
        if isinstance(head, ReplaySource):
            return True
        if isinstance(head, Replay):
            return is_large(head.payload)
        return is_large(head.raw if isinstance(head, Batch) else head)

    def pop_frame(self, transfers: Transfers, parts: list[Buffer]) -> int:
        """Append the next frame to `parts`, if one may be sent.

        A FRAGMENT is appended as two parts, its head and its payload, to avoid a copy.

        Returns:
            The size of the frame; 0 if nothing may be sent, or if it is a large frame and too many transfers
            are open.
        """
        if self._transfer is None:
            raw = self._prepare(transfers)
            if self._transfer is None:
                if raw:
                    self._finish(self._pop())
                    parts.append(raw)
                return len(raw)
            # From its first fragment on the item must be sent to its end, whatever is dropped meanwhile.
            self._leaving = self._pop()
        head, payload, last = self._transfer.next()
        if last:
            transfers.end(self._transfer)
            item, self._leaving, self._transfer = self._leaving, None, None
            self._finish(cast("Batch | Ordered", item))
        parts += (head, payload)
        return len(head) + len(payload)

    def _prepare(self, transfers: Transfers) -> Buffer:
        """Return the encoded frame of the first item, cut to what may be sent now; nothing if it must wait.

        Of a large frame `_transfer` is started instead.
        """
        # The only check of credit on the way of a message: the outbox just tries the queue.
        if not self.sendable or (transfers.full and self.is_large):
            return b""
        head = self._front[0] if self._front else self._queue[0]
        if isinstance(head, Batch):
            start, stop = self._skip, head.length
            if self.sequence_limit is not None:
                stop = min(stop, max(self.sequence_limit - head.first_sequence, start + 1))
            if self.byte_limit is not None:
                stop = min(stop, fitting_stop(head, start, self.byte_limit - self.sent_bytes))
            if start or stop < head.length or (self.publisher and head.publisher != self.publisher):
                head = self._cut(head, start, stop)
            raw = head.raw
            if not raw:
                return self._prepare_shared(cast("SharedBatch", head), transfers)
        else:
            if isinstance(head, Replay | ReplaySource):
                return self._prepare_latched(head, transfers)
            raw = head
        if is_large(raw):
            self._transfer = transfers.start(raw)
            return b""
        return raw

    def _prepare_latched(self, head: Replay | ReplaySource, transfers: Transfers) -> Buffer:
        """Do the same for latched messages."""
        if isinstance(head, ReplaySource):
            # One batch at a time: all that is latched may be much more than the link should hold.
            self._replace_source(head)
            return self._prepare(transfers)
        raw, first = head.payload, b""
        if is_large(raw):
            first = encode_head(head)  # the payload is not copied behind it
        else:
            raw = encode(head)
        if is_large(raw):
            self._transfer = transfers.start(raw, first)
            return b""
        return raw

    def _replace_source(self, source: ReplaySource) -> None:
        """Put the next batch of the first item, a source, in front of it; remove a source that has ended."""
        items = self._front or self._queue
        if source.next_bytes():
            replay = source.pop()
            items.appendleft(replay)
            self._count_control(replay, 1)
        else:
            items.popleft()
            self._count_control(source, -1)

    def _cut(self, head: Batch, start: int, stop: int) -> Batch:
        """Let messages `start` to `stop` (excluded) of the first batch be the first; return that.

        It gets the publisher's id on this link. The messages before, which have been dropped, are removed;
        those behind become the second batch.
        """
        batch = slice_batch(head, start, stop)
        if self.publisher:
            batch = with_publisher(batch, self.publisher)
        if batch is not head:
            self._queue.popleft()
            self._count(head, -1, start)
            if stop < head.length:
                rest = slice_batch(head, stop, head.length)
                self._count(rest, 1)
                self._queue.appendleft(rest)
            self._count(batch, 1)
            self._queue.appendleft(batch)
            self._skip = 0
        return batch

    def _prepare_shared(self, batch: SharedBatch, transfers: Transfers) -> bytes:
        """Return the frame of messages in shared memory; nothing if they wait, or leave in fragments."""
        references = transfers.references
        # A part that has been cut off may be too small.
        large = message_bytes(batch) >= MIN_REFERENCE_BYTES
        if references is not None and large and references.allows(batch.slot):
            if references.full:
                self.blocked = True
                return b""
            return references.refer(batch)
        if batch.length > 1:
            batch = cast("SharedBatch", self._cut(batch, 0, 1))
        head, messages = bytes_head(batch), batch.messages
        raw = b""
        if not is_large_size(len(head) + len(messages)):
            raw = b"".join((head, messages))
        else:
            self._transfer = transfers.start(messages, head, shared=True)
        if references is not None and (raw or self._transfer is not None):
            references.copied += 1
        return raw

    def _pop(self) -> Batch | Ordered:
        """Remove and return the first item, which begins to leave: a batch does not wait any more."""
        item = self._front.popleft() if self._front else self._queue.popleft()
        if isinstance(item, Batch):
            self._count(item, -1)
        return item

    def _finish(self, item: Batch | Ordered) -> None:
        """Count an item whose last byte is sent."""
        if isinstance(item, Batch):
            self.sent += item.length
            self.sent_bytes += message_bytes(item)
            self.next_sequence = item.first_sequence + item.length
        else:
            self._count_control(item, -1)

    # The ends of links

    def restart(self, publisher: int, next_sequence: int | None = None) -> None:
        """Prepare for a new link: no credit yet, and a partly sent batch becomes whole again.

        Control frames are removed, since they carry ids of the old link. So are messages queued to be sent
        again: if the new link needs them, the owner inserts them with `put_front`.

        Args:
            publisher: The publisher's id on the new link.
            next_sequence: The number declared on the new link; messages dropped since then use no credit.
                None takes the number of the first message.
        """
        if self.next_sequence is not None:
            self.resend_below = max(self.resend_below, self.next_sequence)
        self._front.clear()
        self._cut_skipped()
        self._queue = deque(item for item in self._queue if isinstance(item, Batch))
        if isinstance(self._leaving, Batch):
            self.put_front(self._leaving)
        self._leaving = self._transfer = None
        while (first := self.first_sequence) is not None and first < self.resend_below:
            self._drop_first(self.resend_below - first)
        self.next_sequence = self.first_sequence if next_sequence is None else next_sequence
        self.publisher = publisher
        self.sent_bytes = self.control_bytes = self.bulk_bytes = self.counted_bytes = 0
        self.sequence_limit = self.byte_limit = None
        self.scheduled = self.blocked = False

    def discard(self, transfers: Transfers) -> bytes | None:
        """Abandon everything, because no subscription needs it any more.

        Returns:
            The encoded ABORT of the transfer that was open, if any.
        """
        self.abandoned += self.pending + self.leaving
        transfer = self._transfer
        self._clear()
        if transfer is None:
            return None
        transfers.end(transfer)
        return encode(Abort(transfer.id))

    def mark_lost(self, batch: Batch | None = None) -> None:
        """Count messages that cannot be sent because the link has ended.

        Args:
            batch: A batch that is not in the queue; None counts and removes everything that waits.
        """
        if batch is not None:
            self.lost_on_break += batch.length
            return
        self.lost_on_break += self.pending + self.leaving
        self._clear()

    def _clear(self) -> None:
        self._front.clear()
        self._queue.clear()
        self._leaving = self._transfer = None
        self.blocked = False
        self.pending = self.pending_bytes = self.control_bytes = self.bulk_bytes = 0
        self._skip = self._batches = self._attributes_bytes = 0
