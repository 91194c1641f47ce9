"""The unsent messages of one publisher, bounded by a history depth.

Messages travel in batches, but depth counts messages. A drop therefore need not remove a whole batch: it may
mark the first messages of the oldest batch as skipped. They are cut off when that batch is sent or moved.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from dataclasses import dataclass, field
from typing import TypeAlias, cast

from proto import limits
from proto.queues.batches import attributes_bytes, message_bytes, slice_batch, with_publisher
from proto.wire.fragments import is_large
from proto.wire.frames import Batch, Replay
from proto.wire.references import SharedBatch


class ReplaySource(ABC):
    """Latched messages that are taken from where they are kept only when they can be sent."""

    __slots__ = ()

    @abstractmethod
    def next_bytes(self) -> int:
        """Return the size of the next latched batch; 0 if there is none."""

    @abstractmethod
    def take(self) -> Replay:
        """Return the next latched batch. Needs `next_bytes` > 0."""


Ordered: TypeAlias = ReplaySource | Replay | bytes
"""Anything but a batch that waits in order with batches."""


@dataclass(slots=True, eq=False, repr=False)
class MessageQueue:
    """Batches of one publisher, with other frames in order between them."""

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
    dropped: int = field(default=0, init=False)
    """Messages dropped so far because the link was slower than the publisher."""
    dropped_for_bytes: int = field(default=0, init=False)
    """Those of them that fitted the depth but not a limit in bytes."""
    resend_below: int = field(default=0, init=False)
    """Messages with smaller numbers have been sent on an earlier link and are queued to be sent again."""
    abandoned: int = field(default=0, init=False)
    """Messages discarded without loss: no subscription needed them any more, or they had been sent before."""
    _front: deque[Ordered] = field(default_factory=deque["Ordered"], init=False)
    """Frames that preceded dropped messages. They are sent first, so that later drops need not pass them."""
    _queue: deque[Batch | Ordered] = field(default_factory=deque["Batch | Ordered"], init=False)
    _batches: int = field(default=0, init=False)
    """Number of batches in `_queue`."""
    _attributes_bytes: int = field(default=0, init=False)
    """Estimated memory of their attributes."""
    _skip: int = field(default=0, init=False)
    """Number of dropped messages at the start of the first batch in `_queue`."""
    _next_sequence: int | None = field(default=None, init=False)
    """The number after the last message sent on this link; before the first one, the declared number."""

    def put(self, item: Batch | Ordered) -> None:
        """Append a batch, or a frame that must follow the batches before it.

        Args:
            item: A batch, latched messages (encoded when they are sent), a source of such, or another encoded
                frame.
        """
        self._queue.append(item)
        if isinstance(item, Batch):
            self._batches += 1
            self.pending += item.length
            self.pending_bytes += message_bytes(item)
            if item.attributes is not None:
                self._attributes_bytes += attributes_bytes(item.attributes)
            if self._next_sequence is None:
                self._next_sequence = item.first_sequence
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
        self._batches += 1
        self.pending += item.length
        self.pending_bytes += message_bytes(item)
        if item.attributes is not None:
            self._attributes_bytes += attributes_bytes(item.attributes)
        if self._next_sequence is None or item.first_sequence < self._next_sequence:
            self._next_sequence = item.first_sequence
        self._queue.appendleft(item)

    def _count_control(self, item: Ordered, sign: int) -> None:
        """Add a frame to the byte counts (`sign` 1), or subtract it (-1)."""
        raw = b"" if isinstance(item, ReplaySource) else item.payload if isinstance(item, Replay) else item
        size = sign * (len(raw) + limits.FRAME_OVERHEAD_BYTES)
        self.control_bytes += size
        if isinstance(item, Replay) or is_large(raw):
            self.bulk_bytes += size

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
    def next_sequence(self) -> int | None:
        """The number after the last message sent, or the one with which it began; None for neither."""
        return self._next_sequence

    def control_frames(self) -> list[bytes]:
        """Return the frames between the messages, without latched messages."""
        return [item for item in (*self._front, *self._queue) if isinstance(item, bytes)]

    def trim(self) -> None:
        """Drop the oldest messages beyond the depth and beyond `limits.MAX_QUEUE_BYTES`.

        The byte limit never drops the last message. Other frames keep their order.
        """
        if self.depth is None or (
            self.pending <= self.depth and self.pending_bytes <= limits.MAX_QUEUE_BYTES
        ):
            return
        most = self.depth + self._beyond_depth()
        while self.pending > most:
            self._drop_first(self.pending - most)
        while self.pending_bytes > limits.MAX_QUEUE_BYTES and self.pending > 1:
            self.drop_oldest_batch()

    def _beyond_depth(self) -> int:
        """Return how many messages may wait beside `depth`."""
        return 0

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
        self.pending -= count
        self.dropped += count - resent
        self.abandoned += resent
        if count == left:
            self._batches -= 1
            self.pending_bytes -= message_bytes(head)
            if head.attributes is not None:
                self._attributes_bytes -= attributes_bytes(head.attributes)
            self._skip = 0
        else:
            self._skip += count
            self._queue.appendleft(head)
        return count

    def _cut_skipped(self) -> None:
        """Remove the skipped messages from the first batch, so that another batch may become the first."""
        if not self._skip:
            return
        index = next(index for index, item in enumerate(self._queue) if isinstance(item, Batch))
        whole = cast("Batch", self._queue[index])
        rest = slice_batch(whole, self._skip, whole.length)
        self.pending_bytes -= message_bytes(whole) - message_bytes(rest)
        self._queue[index] = rest
        self._skip = 0

    def _cut_head(self, head: Batch, start: int, stop: int) -> Batch:
        """Let messages `start` to `stop` (excluded) be the first batch, without those before; return it."""
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
                if rest.attributes is not None:
                    self._attributes_bytes += attributes_bytes(rest.attributes)
                self._queue.appendleft(rest)
            self._queue.appendleft(batch)
            self._skip = 0
        return batch

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
            if isinstance(item, SharedBatch) and item.length > 1 and message_bytes(item) > max_bytes:
                self._split(item, waiting)
            elif isinstance(item, Batch) and message_bytes(item) > max_bytes:
                self._batches -= 1
                self.pending -= item.length
                self.pending_bytes -= message_bytes(item)
                if item.attributes is not None:
                    self._attributes_bytes -= attributes_bytes(item.attributes)
                self.dropped += item.length
            else:
                kept.append(item)
        self._queue = kept
        return self.dropped - before

    def _split(self, batch: SharedBatch, waiting: deque[Batch | Ordered]) -> None:
        """Put the messages of a batch in front of what waits, each as a batch of its own."""
        waiting.extendleft(slice_batch(batch, index, index + 1) for index in reversed(range(batch.length)))
        self._batches += batch.length - 1
        if batch.attributes is not None:
            self._attributes_bytes += (batch.length - 1) * attributes_bytes(batch.attributes)
