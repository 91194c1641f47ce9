"""What has come for a subscription and waits to be taken: decoded runs, a batch each.

A batch that finds its reader idle is taken whole. At a busy reader only the newest `depth` messages stay.
Where the publisher sets a lifespan, what gets too old while it waits is thrown away when its turn comes.
"""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.session.attachments import Attachment
    from proto.frames import Batch, Replay


class MessageInfo(NamedTuple):
    """What comes with a message: a callback's second argument."""

    source_timestamp: int
    """When its run was sent, in ns since the epoch, by the publisher's clock."""
    received_timestamp: int
    """When it came in, in ns since the epoch."""
    publication_sequence_number: int
    """Its number among the publisher's messages, from 0."""
    publisher_gid: bytes
    """The publisher's id, the same across reconnects."""
    publisher_node: str
    """The full name of the publisher's node."""


class QueuedBatch:
    """Decoded messages of one run that wait; those from `index` on have not been taken.

    Attributes:
        end: The number after the run's last message.
        size: The bytes of the whole run, for credit.
        expires_at: Loop time after which nothing of it is handed over.
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
        self.received_ns = received_ns
        self.end = 0
        self.size = 0
        self.expires_at = math.inf

    def info(self) -> MessageInfo:
        """Return the message info of the message taken last."""
        flow = self.attachment
        return MessageInfo(self.stamp_ns, self.received_ns, self.numbers[self.index - 1], flow.gid, flow.node)


class Backlog:
    """The batches of one subscription, oldest first.

    Args:
        finished: Told of each batch that is off our hands, in order; None if nobody wants to know.

    Attributes:
        batches: Those of which something waits.
        pending: Messages that wait.
    """

    __slots__ = ("_finished", "batches", "pending")

    def __init__(self, finished: Callable[[QueuedBatch], None] | None = None) -> None:
        self.batches: deque[QueuedBatch] = deque()
        self.pending = 0
        self._finished = finished

    @property
    def newest(self) -> QueuedBatch | None:
        """The batch that has come last, if it waits still."""
        return self.batches[-1] if self.batches else None

    def put(self, queued_batch: QueuedBatch) -> None:
        """A run has come."""
        self.batches.append(queued_batch)
        self.pending += len(queued_batch.messages)

    def take(self) -> Any:
        """Take the oldest message. Needs one."""
        queued_batch = self.batches[0]
        message = queued_batch.messages[queued_batch.index]
        queued_batch.index += 1
        self.pending -= 1
        if queued_batch.index == len(queued_batch.messages):
            self.finish()
        return message

    def finish(self) -> None:
        """All messages of the first batch have been taken."""
        queued_batch = self.batches.popleft()
        if self._finished is not None:
            self._finished(queued_batch)

    def trim(self, depth: int) -> int:
        """Drop the oldest messages beyond the depth; return how many that were."""
        excess = gone = max(0, self.pending - depth)
        while excess > 0:
            queued_batch = self.batches[0]
            part = min(excess, len(queued_batch.messages) - queued_batch.index)
            queued_batch.index += part
            excess -= part
            if queued_batch.index == len(queued_batch.messages):
                self.batches.popleft()
        self.pending -= gone
        return gone

    def expire(self, now: float) -> int:
        """Drop what is too old, from the oldest on; return how many messages that were."""
        gone = 0
        while self.batches and self.batches[0].expires_at <= now:
            queued_batch = self.batches[0]
            gone += len(queued_batch.messages) - queued_batch.index
            self.pending -= len(queued_batch.messages) - queued_batch.index
            self.finish()
        return gone

    def clear(self) -> None:
        """Drop everything."""
        self.batches.clear()
        self.pending = 0
