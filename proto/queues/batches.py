"""Batches: consecutive messages of one publisher in one frame (docs/protocol.md §6.1).

A batch carries the offsets at which its messages end. With them it can be split at any message, and get
another publisher id, without decoding the messages: the broker never looks into a message.

Batches are immutable and shared: the same object waits for several links, and its bytes for all of them. What
changes one returns another, whose payload is a view of the same bytes where possible.
"""

from __future__ import annotations

from array import array
from bisect import bisect_left
from itertools import accumulate
from typing import TYPE_CHECKING, Final

from proto import limits
from proto.wire.codec import ARRAY_HEAD_BYTES, array_head, batch_head, encode
from proto.wire.ends import ends_from_bytes, ends_to_bytes
from proto.wire.frames import Batch, Options, Replay, Scalar
from proto.wire.references import SLOT_HEAD_BYTES, SharedBatch, Slot, shared_batch
from proto.wire.stamps import cut_stamps

if TYPE_CHECKING:
    from collections.abc import Iterable

MAX_HEAD_BYTES: Final = 64
"""Maximum size of everything before the message in a batch of one: prefix, header and array head."""


class BatchBuilder:
    """Collects a publisher's messages until they are sent as a batch.

    The messages of a batch are either bytes, which are copied once, when the batch is taken, or lie in one
    slot of shared memory.

    Args:
        next_sequence: The number of the first message.

    Attributes:
        next_sequence: The number of the first message of the next batch.
        messages: The messages collected as bytes.
        size: The bytes of these.
        slot: The slot in shared memory where the messages are, if they are there.
    """

    __slots__ = ("_slot_ends", "messages", "next_sequence", "size", "slot")

    def __init__(self, next_sequence: int) -> None:
        self.next_sequence = next_sequence
        self.messages: list[bytes] = []
        self.size = 0
        self.slot: Slot | None = None
        self._slot_ends = array("I")

    @property
    def length(self) -> int:
        """Messages collected."""
        return len(self.messages) or len(self._slot_ends)

    def add(self, message: bytes) -> bool:
        """Add an encoded message, if there is no `slot`; return whether the batch is to be sent now."""
        self.messages.append(message)
        self.size += len(message)
        return self.size >= limits.BATCH_FLUSH_BYTES or len(self.messages) >= limits.BATCH_FLUSH_COUNT

    def add_shared(self, slot: Slot) -> None:
        """Add the last message in a slot. The others in it must have been added, and nothing else."""
        self.slot = slot
        self._slot_ends.append(slot.size)

    def build(self, publisher: int, stamp_ns: int, attributes: Options | None = None) -> Batch:
        """Return the collected messages as one batch, encoded or in shared memory, and start the next one."""
        slot = self.slot
        if slot is not None:
            ends, self._slot_ends, self.slot = self._slot_ends, array("I"), None
            fields = self._number(publisher, stamp_ns, len(ends), ends, attributes)
            return shared_batch(slot, fields, SLOT_HEAD_BYTES, slot.size)
        messages, size = self.messages, self.size
        self.messages, self.size = [], 0
        fields = self._number(publisher, stamp_ns, len(messages), accumulate(map(len, messages)), attributes)
        head = batch_head(fields, size + ARRAY_HEAD_BYTES)
        raw = b"".join((head, array_head(len(messages)), *messages))
        return Batch(*fields, memoryview(raw)[len(head) :], raw)

    def single(self, buffer: bytearray, publisher: int, stamp_ns: int) -> Batch:
        """Return the large message behind the first `MAX_HEAD_BYTES` of `buffer` as a batch, without a copy.

        Needs `length` 0. The batch owns the buffer from now on.
        """
        assert not self.length
        fields = self._number(publisher, stamp_ns, 1, ())
        # The head is written right before the message, so the frame begins somewhere in the free bytes.
        payload_bytes = len(buffer) - MAX_HEAD_BYTES + ARRAY_HEAD_BYTES
        head = batch_head(fields, payload_bytes) + array_head(1)
        start = MAX_HEAD_BYTES - len(head)
        buffer[start:MAX_HEAD_BYTES] = head
        raw = memoryview(buffer)[start:].toreadonly()
        return Batch(*fields, raw[len(raw) - payload_bytes :], raw)

    def _number(
        self,
        publisher: int,
        stamp_ns: int,
        count: int,
        ends: Iterable[int],
        attributes: Options | None = None,
    ) -> tuple[int, int, int, int, bytes | None, Options | None]:
        """Return the first six fields of the next batch. One message alone needs no ends."""
        first = self.next_sequence
        self.next_sequence = first + count
        encoded_ends = ends_to_bytes(array("I", ends)) if count > 1 else None
        return publisher, first, stamp_ns, count, encoded_ends, attributes


def with_raw(batch: Batch) -> Batch:
    """Return the batch with its encoded frame, and its payload as a view into it."""
    raw = encode(batch)
    return batch._replace(raw=raw, payload=memoryview(raw)[len(raw) - len(batch.payload) :])


def slice_batch(batch: Batch, start: int, stop: int) -> Batch:
    """Return messages `start` (included) to `stop` (excluded) as a batch of their own.

    Needs 0 <= start < stop <= batch.length.
    """
    if start == 0 and stop == batch.length:
        return batch
    assert batch.ends is not None
    offsets = ends_from_bytes(batch.ends)
    base = offsets[start - 1] if start else 0
    count = stop - start
    ends = None
    if count > 1:
        ends = ends_to_bytes(array("I", [offset - base for offset in offsets[start:stop]]))
    first = batch.first_sequence + start
    attributes = None if batch.attributes is None else cut_stamps(batch.attributes, first, count)
    fields = batch.publisher, first, batch.stamp_ns, count, ends, attributes
    if isinstance(batch, SharedBatch):
        return shared_batch(batch.slot, fields, batch.start + base, offsets[stop - 1] - base)
    body = memoryview(batch.payload)[ARRAY_HEAD_BYTES + base : ARRAY_HEAD_BYTES + offsets[stop - 1]]
    return with_raw(Batch(*fields, array_head(count) + body, b""))


def fitting_stop(batch: Batch, start: int, max_bytes: int) -> int:
    """Return the index after the last message that begins within `max_bytes` bytes from message `start`.

    The last message may end beyond the limit: otherwise a message larger than the whole credit could never be
    sent. Needs `max_bytes` > 0, so that at least one message fits.
    """
    if batch.ends is None:
        return batch.length
    offsets = ends_from_bytes(batch.ends)
    base = offsets[start - 1] if start else 0
    return min(bisect_left(offsets, base + max_bytes, start) + 1, batch.length)


def with_publisher(batch: Batch, publisher: int) -> Batch:
    """Return the batch with another publisher id: a publisher gets a new one in each session."""
    if batch.publisher == publisher:
        return batch
    if isinstance(batch, SharedBatch):
        return shared_batch(batch.slot, (publisher, *batch[1:6]), batch.start, message_bytes(batch))
    return with_raw(batch._replace(publisher=publisher, raw=b""))


def split_messages(batch: Batch | Replay) -> list[memoryview]:
    """Return the encoded messages of a batch as views."""
    body = memoryview(batch.payload)[ARRAY_HEAD_BYTES:]
    if batch.ends is None:
        return [body]
    offsets = ends_from_bytes(batch.ends).tolist()
    return [body[start:end] for start, end in zip([0, *offsets[:-1]], offsets, strict=True)]


def held_bytes(batch: Batch) -> int:
    """Return the estimated memory of a batch that is kept."""
    size = len(batch.payload) + limits.BATCH_OVERHEAD_BYTES + limits.MESSAGE_OVERHEAD_BYTES * batch.length
    return size if batch.attributes is None else size + attributes_bytes(batch.attributes)


def attributes_bytes(attributes: Options) -> int:
    """Return the estimated memory of attributes: encoded, and as objects."""
    return sum(140 + _text_bytes(key) + _text_bytes(value) for key, value in attributes.items())


def _text_bytes(value: Scalar) -> int:
    if not isinstance(value, str | bytes):
        return 0
    return 2 * len(value) if value.isascii() or isinstance(value, bytes) else 8 * len(value)


def message_bytes(batch: Batch | Replay) -> int:
    """Return the size of the messages of a batch, as credit counts it."""
    return len(batch.payload) - ARRAY_HEAD_BYTES
