"""Runs: many messages of one publisher in one frame, built, cut and addressed without decoding them."""

from __future__ import annotations

from array import array
from bisect import bisect_left
from typing import Final

from proto import limits
from proto.codec import ARRAY_HEAD_BYTES, array_head, batch_head, encode, ends_from_bytes, ends_to_bytes
from proto.frames import Batch, Replay

MAX_HEAD_BYTES: Final = 64
"""Bytes that the head of a run of one message takes at most, the array's included."""


class BatchBuilder:
    """Collects a publisher's messages until they are sent.

    Messages are numbered from the `next_sequence` given; `length` counts those collected. `take` returns them
    as a run and starts the next one.
    """

    __slots__ = ("_buffer", "_ends", "length", "next_sequence")

    def __init__(self, next_sequence: int) -> None:
        self.next_sequence = next_sequence
        self._buffer = bytearray(ARRAY_HEAD_BYTES)
        self._ends = array("I")
        self.length = 0

    def add(self, message: bytes) -> bool:
        """Collect an encoded message; True if the run should go now."""
        buffer = self._buffer
        buffer += message
        end = len(buffer) - ARRAY_HEAD_BYTES
        self._ends.append(end)
        self.length += 1
        return end >= limits.BATCH_FLUSH_BYTES or self.length >= limits.BATCH_FLUSH_COUNT

    def take(self, publisher: int, stamp_ns: int) -> Batch:
        """Return everything collected as one run, encoded."""
        payload, count = self._buffer, self.length
        payload[:ARRAY_HEAD_BYTES] = array_head(count)
        ends = ends_to_bytes(self._ends) if count > 1 else None
        self._buffer = bytearray(ARRAY_HEAD_BYTES)
        self._ends = array("I")
        self.length = 0
        fields = self._number(publisher, stamp_ns, count, ends)
        head = batch_head(fields, len(payload))
        raw = head + payload
        return Batch(*fields, memoryview(raw)[len(head) :], raw)

    def single(self, buffer: bytearray, publisher: int, stamp_ns: int) -> Batch:
        """Return the large message behind the first `MAX_HEAD_BYTES` of `buffer` as a batch, without a copy.

        Needs length 0; the buffer is the run's from now on.
        """
        assert not self.length
        fields = self._number(publisher, stamp_ns, 1, None)
        payload_bytes = len(buffer) - MAX_HEAD_BYTES + ARRAY_HEAD_BYTES
        head = batch_head(fields, payload_bytes) + array_head(1)
        start = MAX_HEAD_BYTES - len(head)
        buffer[start:MAX_HEAD_BYTES] = head
        raw = memoryview(buffer)[start:].toreadonly()
        return Batch(*fields, raw[len(raw) - payload_bytes :], raw)

    def _number(
        self, publisher: int, stamp_ns: int, count: int, ends: bytes | None
    ) -> tuple[int, int, int, int, bytes | None, None]:
        first = self.next_sequence
        self.next_sequence = first + count
        return publisher, first, stamp_ns, count, ends, None


def with_raw(batch: Batch) -> Batch:
    """Return the run encoded, its payload a view into the encoded bytes."""
    raw = encode(batch)
    return batch._replace(raw=raw, payload=memoryview(raw)[len(raw) - len(batch.payload) :])


def slice_batch(batch: Batch, start: int, stop: int) -> Batch:
    """Return messages `start` (included) to `stop` (excluded) of a run, as an encoded run of their own.

    Needs 0 <= start < stop <= run.length.
    """
    if start == 0 and stop == batch.length:
        return batch
    assert batch.ends is not None
    offsets = ends_from_bytes(batch.ends)
    base = offsets[start - 1] if start else 0
    body = memoryview(batch.payload)[ARRAY_HEAD_BYTES + base : ARRAY_HEAD_BYTES + offsets[stop - 1]]
    count = stop - start
    ends = None
    if count > 1:
        ends = ends_to_bytes(array("I", [offset - base for offset in offsets[start:stop]]))
    payload = array_head(count) + body
    return with_raw(
        Batch(
            batch.publisher,
            batch.first_sequence + start,
            batch.stamp_ns,
            count,
            ends,
            batch.attributes,
            payload,
            b"",
        )
    )


def fitting_stop(batch: Batch, start: int, room: int) -> int:
    """Return where to stop so that each message from `start` on begins within the next `room` bytes.

    Needs room > 0, so at least one message fits: it may end beyond.
    """
    if batch.ends is None:
        return batch.length
    offsets = ends_from_bytes(batch.ends)
    base = offsets[start - 1] if start else 0
    return min(bisect_left(offsets, base + room, start) + 1, batch.length)


def with_publisher(batch: Batch, publisher: int) -> Batch:
    """Return the run under another publisher id: the broker gives a new one with every link."""
    return batch if batch.publisher == publisher else with_raw(batch._replace(publisher=publisher, raw=b""))


def split_messages(batch: Batch | Replay) -> list[memoryview]:
    """Return the encoded messages of a run one by one, as views: what remains when a run does not decode."""
    body = memoryview(batch.payload)[ARRAY_HEAD_BYTES:]
    if batch.ends is None:
        return [body]
    offsets = ends_from_bytes(batch.ends).tolist()
    return [body[start:end] for start, end in zip([0, *offsets[:-1]], offsets, strict=True)]


def message_bytes(batch: Batch | Replay) -> int:
    """Return the size of a run's messages: what credit counts."""
    return len(batch.payload) - ARRAY_HEAD_BYTES
