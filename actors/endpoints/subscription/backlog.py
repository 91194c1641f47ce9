"""Decoded batches of a subscription that wait to be taken.

An idle consumer takes a whole batch. For a busy one only the newest `depth` messages stay. Where the
publisher sets a lifespan, messages that expire while they wait are dropped when they would be taken.

Batches are kept as they arrived, with an index, instead of message by message: only the first batch can be
taken in part, and an object for each message would cost about as much as decoding it.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple

from proto.wire.stamps import stamp_of, stamps_from

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.session.attachments import Attachment
    from proto.wire.frames import Batch, Replay


class MessageInfo(NamedTuple):
    """What a callback gets as its second argument."""

    source_timestamp: int
    """When its batch was sent, in ns since the epoch, by the publisher's clock; or what `publish_encoded` was
    given."""
    received_timestamp: int
    """When it was received, in ns since the epoch."""
    publication_sequence_number: int
    """Its number among the publisher's messages, from 0."""
    publisher_gid: bytes
    """The publisher's id, the same across reconnects."""
    publisher_node: str
    """The full name of the publisher's node."""


class QueuedBatch:
    """The decoded messages of one batch; those from `index` on have not been taken.

    Attributes:
        end: The number after the batch's last message.
        size: The bytes of the whole batch, for credit.
        expires_at: Loop time after which none of its messages is handed over.
    """

    __slots__ = (
        "attachment",
        "end",
        "expires_at",
        "index",
        "messages",
        "numbers",
        "received_ns",
        "size",
        "stamp_ns",
        "stamps",
    )

    def __init__(
        self,
        attachment: Attachment,
        batch: Batch | Replay,
        decoded: list[Any],
        numbers: Sequence[int],
        received_ns: int,
    ) -> None:
        self.attachment = attachment
        self.messages = decoded
        self.index = 0
        self.numbers = numbers
        self.stamp_ns = batch.stamp_ns
        attributes = batch.attributes
        self.stamps = (
            () if attributes is None else stamps_from(attributes, batch.first_sequence, batch.length)
        )
        self.received_ns = received_ns
        self.end = 0
        self.size = 0
        self.expires_at = math.inf

    def info(self) -> MessageInfo:
        """Return the message info of the message taken last."""
        publisher = self.attachment
        number = self.numbers[self.index - 1]
        stamp_ns = stamp_of(self.stamps, number, self.stamp_ns) if self.stamps else self.stamp_ns
        return MessageInfo(stamp_ns, self.received_ns, number, publisher.gid, publisher.node)


class Backlog:
    """The batches of one subscription, oldest first.

    Args:
        finished: Called with each batch of which nothing waits any more, in order; None if not needed.

    Attributes:
        batches: Those of which messages wait.
        pending: Messages that wait.
    """

    __slots__ = ("_finished", "batches", "pending")

    def __init__(self, finished: Callable[[QueuedBatch], None] | None = None) -> None:
        self.batches: deque[QueuedBatch] = deque()
        self.pending = 0
        self._finished = finished

    @property
    def newest(self) -> QueuedBatch | None:
        """The batch received last, if it still waits."""
        return self.batches[-1] if self.batches else None

    def put(self, queued_batch: QueuedBatch) -> None:
        """Add a batch."""
        self.batches.append(queued_batch)
        self.pending += len(queued_batch.messages)

    def pop(self) -> Any:
        """Remove and return the oldest message. There must be one."""
        queued_batch = self.batches[0]
        message = queued_batch.messages[queued_batch.index]
        queued_batch.index += 1
        self.pending -= 1
        if queued_batch.index == len(queued_batch.messages):
            self.finish()
        return message

    def finish(self) -> None:
        """Remove the first batch: all of its messages have been taken."""
        queued_batch = self.batches.popleft()
        if self._finished is not None:
            self._finished(queued_batch)

    def trim(self, depth: int) -> int:
        """Drop the oldest messages beyond the depth; return how many."""
        excess = dropped = max(0, self.pending - depth)
        while excess > 0:
            queued_batch = self.batches[0]
            part = min(excess, len(queued_batch.messages) - queued_batch.index)
            queued_batch.index += part
            excess -= part
            if queued_batch.index == len(queued_batch.messages):
                self.batches.popleft()  # not `finish`: only KEEP_LAST drops, and it grants no credit
        self.pending -= dropped
        return dropped

    def expire(self, now: float) -> int:
        """Drop expired batches, from the oldest on; return how many messages they had."""
        dropped = 0
        while self.batches and self.batches[0].expires_at <= now:
            queued_batch = self.batches[0]
            dropped += len(queued_batch.messages) - queued_batch.index
            self.pending -= len(queued_batch.messages) - queued_batch.index
            self.finish()
        return dropped

    def shift(self, seconds: float) -> None:
        """Let everything that waits expire later; the seconds may be negative."""
        for queued_batch in self.batches:
            queued_batch.expires_at += seconds

    def clear(self) -> None:
        """Drop everything."""
        self.batches.clear()
        self.pending = 0


class SharedBacklog(Backlog):
    """A backlog that any thread takes from; messages are added and dropped in the loop's thread.

    The caller of `pop`, `expire` or `finish` holds the lock.

    Args:
        finished: As for `Backlog`; called in the loop's thread.
        call_in_loop: Calls a function in the loop's thread, at once if this is the one.

    Attributes:
        lock: Held while the backlog changes.
    """

    __slots__ = ("_call_in_loop", "_done", "_report", "lock")

    def __init__(
        self,
        finished: Callable[[QueuedBatch], None] | None,
        call_in_loop: Callable[[Callable[[], None]], None],
    ) -> None:
        super().__init__(None if finished is None else self._defer)
        self.lock = threading.Lock()
        self._call_in_loop = call_in_loop
        self._report = finished
        self._done: deque[QueuedBatch] = deque()

    def _defer(self, queued_batch: QueuedBatch) -> None:
        self._done.append(queued_batch)
        if len(self._done) == 1:  # else a call is on its way
            self._call_in_loop(self._report_done)

    def _report_done(self) -> None:
        assert self._report is not None
        while self._done:
            self._report(self._done.popleft())

    @property
    def newest(self) -> QueuedBatch | None:
        """The batch received last, if it still waits."""
        with self.lock:
            return self.batches[-1] if self.batches else None

    def put(self, queued_batch: QueuedBatch) -> None:
        """Add a batch."""
        with self.lock:
            super().put(queued_batch)

    def trim(self, depth: int) -> int:
        """Drop the oldest messages beyond the depth; return how many."""
        with self.lock:
            return super().trim(depth)

    def shift(self, seconds: float) -> None:
        """Let everything that waits expire later; the seconds may be negative."""
        with self.lock:
            super().shift(seconds)

    def clear(self) -> None:
        """Drop everything."""
        with self.lock:
            super().clear()
