"""The send queue of one publisher on one link: what may be sent, and when.

Four rules hold at every moment:

- **Depth.** Of the messages that cannot be sent, the newest `depth` are kept (`MessageQueue`). The owner
  first sends what the transport takes and then calls `trim`, so a fast link drops nothing.
- **Credit.** A message is sent only below `sequence_limit` and `byte_limit`. A batch that reaches beyond a
  limit is cut: its first part is sent, the rest waits.
- **Order.** Messages are sent in the order of their numbers. Frames that refer to them (ATTACHED, DETACHED,
  REPLAY, UNDECLARE) are queued between them and never overtake them.
- **Large frames.** A frame above `limits.MAX_FRAME_BYTES` is sent in fragments, one each time the outbox
  serves the queue. Meanwhile its messages count as `leaving`, no longer as `pending`.

A batch in shared memory (`references.py`) is sent by reference to a peer that can read it, and to any other
as bytes, message by message: together they may be much more than a frame.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from itertools import chain
from typing import TYPE_CHECKING, cast

from proto.queues.batches import attributes_bytes, fitting_stop, message_bytes
from proto.queues.message_queue import MessageQueue, Ordered, ReplaySource
from proto.wire.codec import encode, encode_head
from proto.wire.fragments import is_large, is_large_size
from proto.wire.frames import Abort, Batch, Buffer, Replay
from proto.wire.references import MIN_REFERENCE_BYTES, SharedBatch, bytes_head

if TYPE_CHECKING:
    from proto.wire.fragments import Transfer, Transfers


@dataclass(slots=True, eq=False, repr=False)
class PublisherQueue(MessageQueue):
    """The unsent messages of one publisher on one link, with its credit and the batch being sent."""

    sent: int = field(default=0, init=False)
    """Messages handed to the transport completely."""
    sent_bytes: int = field(default=0, init=False)
    """Bytes of messages sent on this link, for comparison with `byte_limit`."""
    lost_on_break: int = field(default=0, init=False)
    """Messages that could not be sent because the link had ended."""
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
    _leaving: Batch | Ordered | None = field(default=None, init=False)
    """The item whose fragments are being sent; it is in no queue any more."""
    _transfer: Transfer | None = field(default=None, init=False)

    def _beyond_depth(self) -> int:
        if not self.keeps_credit or self.sequence_limit is None or not self._has_credit:
            return 0
        return max(0, self.sequence_limit - cast("int", self._next_sequence))

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
        return self._next_sequence or 0

    @property
    def sendable(self) -> bool:
        """Whether there is a next item and credit allows to send it."""
        if self._leaving is not None or self._front:
            return True
        if not self._queue or self.blocked:
            return False
        return not isinstance(self._queue[0], Batch) or self._has_credit

    @property
    def _has_credit(self) -> bool:
        """Whether credit allows to send a message now. Needs that there was one."""
        # Do not compare the waiting message's own number: after a gap of dropped messages it may exceed every
        # limit that a subscription which has not seen the gap will ever grant.
        if self.sequence_limit is not None and cast("int", self._next_sequence) >= self.sequence_limit:
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

    def take_next(self, transfers: Transfers, parts: list[Buffer]) -> int:
        """Append the next frame to `parts`. Needs `sendable`.

        A FRAGMENT is appended as two parts, its head and its payload, to avoid a copy.

        Returns:
            The size of the frame; 0 if it is a large one and too many transfers are open, or if there are no
            latched messages any more.
        """
        if self._transfer is None:
            if transfers.full and self.is_large:
                return 0
            raw = self._prepare_head()
            if is_large(raw):
                item = next(chain(self._front, self._queue))
                head = encode_head(item) if isinstance(item, Replay) and raw is item.payload else b""
                self._transfer = transfers.start(raw, head)
                if self._transfer is None:
                    return 0
            elif not raw:
                raw = self._prepare_shared(transfers)
                if not raw and self._transfer is None:
                    return 0
            self._remove_head()
            if self._transfer is None:
                self._finish_leaving()
                parts.append(raw)
                return len(raw)
        head, payload, last = self._transfer.next()
        if last:
            transfers.end(self._transfer)
            self._finish_leaving()
        parts += (head, payload)
        return len(head) + len(payload)

    def _prepare_shared(self, transfers: Transfers) -> bytes:
        """Return the frame of messages in shared memory at the head of the queue; nothing if they must wait.

        Nothing is returned, either, if it begins to leave in fragments.
        """
        batch = next(chain(self._front, self._queue), None)
        if not isinstance(batch, SharedBatch) or not self.sendable:
            return b""
        references = transfers.references
        # A part that has been cut off may be too small.
        large = message_bytes(batch) >= MIN_REFERENCE_BYTES
        if references is not None and large and references.allows(batch.slot):
            if references.full:
                self.blocked = True
                return b""
            return references.refer(batch)
        if batch.length > 1:
            batch = cast("SharedBatch", self._cut_head(batch, 0, 1))
        head, messages = bytes_head(batch), batch.messages
        raw = b""
        if not is_large_size(len(head) + len(messages)):
            raw = b"".join((head, messages))
        else:
            self._transfer = transfers.start(messages, head, shared=True)
        if references is not None and (raw or self._transfer is not None):
            references.copied += 1
        return raw

    def _prepare_head(self) -> Buffer:
        """Cut the head of the queue to what may be sent now and return its encoded frame.

        Of a large REPLAY only the payload is returned; nothing of a message in shared memory, or if a source
        of latched messages has ended and nothing else may be sent.
        """
        head = self._front[0] if self._front else self._queue[0]
        if not isinstance(head, Batch):
            return self._prepare_ordered(head)
        start, stop = self._skip, head.length
        if self.sequence_limit is not None:
            stop = min(stop, max(self.sequence_limit - head.first_sequence, start + 1))
        if self.byte_limit is not None:
            stop = min(stop, fitting_stop(head, start, self.byte_limit - self.sent_bytes))
        return self._cut_head(head, start, stop).raw

    def _prepare_ordered(self, head: Ordered) -> Buffer:
        if isinstance(head, ReplaySource):
            items = self._front or self._queue
            if not head.next_bytes():
                items.popleft()
                self._count_control(head, -1)
                return self._prepare_head() if self.sendable else b""
            head = head.take()
            items.appendleft(head)
            self._count_control(head, 1)
        if isinstance(head, Replay):
            return head.payload if is_large(head.payload) else encode(head)
        return head

    def _remove_head(self) -> None:
        item = self._leaving = self._front.popleft() if self._front else self._queue.popleft()
        if isinstance(item, Batch):
            self._batches -= 1
            self.pending -= item.length
            self.pending_bytes -= message_bytes(item)
            if item.attributes is not None:
                self._attributes_bytes -= attributes_bytes(item.attributes)

    def _finish_leaving(self) -> None:
        item = self._leaving
        self._leaving = self._transfer = None
        if isinstance(item, Batch):
            self.sent += item.length
            self.sent_bytes += message_bytes(item)
            self._next_sequence = item.first_sequence + item.length
        elif item is not None:
            self._count_control(item, -1)

    def restart(self, publisher: int, next_sequence: int | None = None) -> None:
        """Prepare for a new link: no credit yet, and a partly sent batch becomes whole again.

        Control frames are removed, since they carry ids of the old link. So are messages queued to be sent
        again: if the new link needs them, the owner inserts them with `put_front`.

        Args:
            publisher: The publisher's id on the new link.
            next_sequence: The number declared on the new link; messages dropped since then use no credit.
                None takes the number of the first message.
        """
        if self._next_sequence is not None:
            self.resend_below = max(self.resend_below, self._next_sequence)
        self._front.clear()
        self._cut_skipped()
        self._queue = deque(item for item in self._queue if isinstance(item, Batch))
        if isinstance(self._leaving, Batch):
            self.put_front(self._leaving)
        self._leaving = self._transfer = None
        while (first := self.first_sequence) is not None and first < self.resend_below:
            self._drop_first(self.resend_below - first)
        self._next_sequence = self.first_sequence if next_sequence is None else next_sequence
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
