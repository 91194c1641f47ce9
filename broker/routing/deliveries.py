"""Deliveries: what a router returns for its peers. Each knows how to reach its peer's channel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from proto.errors import ErrorCode, ProtocolError
from proto.wire.frames import Batch, Frame

if TYPE_CHECKING:
    from proto.queues.outbox import Outbox
    from proto.queues.publisher_queue import PublisherQueue, ReplaySource
    from proto.queues.queued_calls import CallShare


class Recipient(Protocol):
    """What deliveries use of a channel."""

    @property
    def outbox(self) -> Outbox:
        """What waits to be sent."""
        ...

    def send(self, frame: Frame) -> None:
        """Queue a control frame."""
        ...

    def fail(self, error: ProtocolError) -> None:
        """Send ERROR with the reason, and close."""
        ...


@dataclass(slots=True)
class Delivery:
    """Something for the peer with this number."""

    peer: int

    def deliver(self, channel: Recipient) -> None:
        """Hand it to the peer's channel; the caller flushes."""
        raise NotImplementedError

    def lose(self) -> None:
        """Count the messages that are lost because the peer's connection has ended."""


@dataclass(slots=True)
class Send(Delivery):
    """Send a control frame."""

    frame: Frame

    def deliver(self, channel: Recipient) -> None:
        """Queue the frame ahead of calls and messages."""
        channel.send(self.frame)


@dataclass(slots=True)
class SendEncoded(Delivery):
    """Send a control frame that is encoded already."""

    raw: bytes

    def deliver(self, channel: Recipient) -> None:
        """Queue the frame ahead of calls and messages."""
        channel.outbox.put_control(self.raw)


@dataclass(slots=True)
class SendCalls(Delivery):
    """Send encoded requests or replies; `key` names a large one (see `Outbox.put_calls`)."""

    raw: bytes
    key: tuple[int, int]
    share: CallShare | None = None

    def deliver(self, channel: Recipient) -> None:
        """Queue the frame ahead of messages."""
        channel.outbox.put_calls(self.raw, self.key, self.share)


@dataclass(slots=True)
class CancelCalls(Delivery):
    """Cancel calls at their server; large requests that have not been sent yet are removed instead."""

    endpoint: int
    calls: list[int]
    share: CallShare | None = None

    def deliver(self, channel: Recipient) -> None:
        """Remove unsent requests, and queue a CANCEL for the others."""
        channel.outbox.cancel_calls(self.endpoint, self.calls, self.share)


@dataclass(slots=True)
class Enqueue(Delivery):
    """Send a batch, or a control frame that keeps its order with batches."""

    queue: PublisherQueue
    item: Batch | bytes

    def deliver(self, channel: Recipient) -> None:
        """Append the item to its publisher queue."""
        channel.outbox.enqueue(self.queue, self.item)

    def lose(self) -> None:
        """Count the messages of a batch."""
        if isinstance(self.item, Batch):
            self.queue.mark_lost(self.item)


@dataclass(slots=True)
class EnqueueLatched(Delivery):
    """Send latched messages before the next batch of a publisher queue."""

    queue: PublisherQueue
    source: ReplaySource

    def deliver(self, channel: Recipient) -> None:
        """Append the first of them to the queue, and the source of the others."""
        channel.outbox.enqueue_source(self.queue, self.source)


@dataclass(slots=True)
class Resume(Delivery):
    """Send what waits in a publisher queue whose credit has changed.

    With `trim`, drop what the credit has kept beyond the depth and cannot be sent.
    """

    queue: PublisherQueue
    trim: bool = False

    def deliver(self, channel: Recipient) -> None:
        """Let the outbox serve the queue again."""
        channel.outbox.schedule(self.queue, trim=self.trim)


@dataclass(slots=True)
class Discard(Delivery):
    """Drop everything in a publisher queue that has no reader any more."""

    queue: PublisherQueue

    def deliver(self, channel: Recipient) -> None:
        """Remove the queue's content from the outbox."""
        channel.outbox.discard_queue(self.queue)

    def lose(self) -> None:
        """Count the messages that are still in the queue."""
        self.queue.mark_lost()


@dataclass(slots=True)
class Shed(Discard):
    """Drop the messages of a publisher queue because too many queues wait; still send its control frames."""

    def deliver(self, channel: Recipient) -> None:
        """Remove the messages from the outbox."""
        channel.outbox.discard_queue(self.queue, shed=True)


@dataclass(slots=True)
class Close(Delivery):
    """Close a peer's connection with an error."""

    code: ErrorCode
    text: str

    def deliver(self, channel: Recipient) -> None:
        """Send ERROR with the reason, and close."""
        channel.fail(ProtocolError(self.code, self.text))
