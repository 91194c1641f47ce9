"""The publishers that the subscriptions of a link are attached to.

The broker sends a publisher's batch to a link once; the link hands it to each of its subscriptions that is
attached to the publisher. An `Attachment` is one such pair. What its subscription must know of the publisher
per message (numbers, credit, lease) is kept in it, so that a batch needs no further lookup.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from proto.untrusted_text import peer_name
from proto.wire.codes import DetachReason
from proto.wire.qos import KEEP_ALL, MANUAL_BY_TOPIC

if TYPE_CHECKING:
    from proto.wire import frames
    from proto.wire.frames import Batch, Options, Replay


class Reader(Protocol):
    """What the link calls on a subscription. At the end of a session only `session_ended` is called."""

    def receive(self, attachment: Attachment, batch: Batch | Replay) -> None:
        """Take a batch of an attached publisher."""
        ...

    def attached(self, attachment: Attachment) -> None:
        """Note that a publisher's batches will arrive."""
        ...

    def detached(self, attachment: Attachment, *, suspended: bool = False) -> None:
        """Note that no more batches will arrive; the end of a suspension is reported separately."""
        ...

    def asserted(self, attachment: Attachment) -> None:
        """Note that the publisher has asserted its liveliness."""
        ...

    def suspension_ended(self) -> None:
        """Note that a suspended publisher is attached again, or gone for good."""
        ...


class Attachment:
    """One publisher's batches for one subscription.

    Attributes:
        reader: The subscription.
        publisher: The publisher's id on this broker.
        gid: The publisher's public id, the same across reconnects.
        node: The publisher's node.
        lifespan_s: Seconds after which the publisher's messages expire; 0 for no limit.
        lease_s: Seconds within which a MANUAL_BY_TOPIC publisher must assert its liveliness; 0 for others.
        keep_all: Whether the publisher is KEEP_ALL, so that it waits for a KEEP_ALL reader.
        current: Whether it is its publisher's newest attachment; set by the reader.
        watched: Whether a deadline or a lease depends on its batches; set by the reader.
        first_sequence: The first live sequence number for this subscription.
        expected: The next sequence number; anything below has been received.
        due: The number of the first message that was for this subscription, over all attachments.
        received: The number after the last message received, latched ones included.
        missed: Messages counted as lost at the attachment; latched ones may still arrive.
        granted_sequence, granted_bytes: Credit granted so far (KEEP_ALL).
        taken_bytes: Bytes of messages that callbacks have taken since the attachment.
        taken_sequence: The number after the last message that callbacks have taken.
    """

    __slots__ = (
        "current",
        "due",
        "expected",
        "first_sequence",
        "gid",
        "granted_bytes",
        "granted_sequence",
        "keep_all",
        "lease_s",
        "lifespan_s",
        "missed",
        "node",
        "publisher",
        "reader",
        "received",
        "taken_bytes",
        "taken_sequence",
        "watched",
    )

    def __init__(self, reader: Reader, attached: frames.Attached) -> None:
        self.reader = reader
        self.publisher = attached.publisher
        self.gid = attached.gid
        self.node = peer_name(attached.node)
        self.lifespan_s = _seconds(attached.qos, "lifespan_ns")
        manual = attached.qos.get("liveliness") == MANUAL_BY_TOPIC
        self.lease_s = _seconds(attached.qos, "lease_ns") if manual else 0.0
        self.keep_all = attached.qos.get("history") == KEEP_ALL
        self.current = self.watched = False
        self.first_sequence = self.expected = self.due = attached.first_sequence
        self.missed = self.received = 0
        self.granted_sequence = self.granted_bytes = 0
        self.taken_bytes = self.taken_sequence = 0


def _seconds(qos: Options, key: str) -> float:
    """Return a time in a QoS map, in seconds; 0 without one."""
    value = qos.get(key, 0)
    return value / 1e9 if isinstance(value, int) and value > 0 else 0.0


class Attachments:
    """The attachments of one link, by publisher."""

    def __init__(self) -> None:
        self._readers: dict[int, Reader] = {}
        self.clear()

    def __len__(self) -> int:
        """Return how many publishers are attached."""
        return len(self._attachments)

    def clear(self) -> None:
        """Forget all attachments: the session has ended, and publisher ids are no longer valid."""
        self._attachments: dict[int, list[Attachment]] = {}
        self._suspended: dict[int, list[Attachment]] = {}
        """Those that ended because their publisher was suspended."""
        self._publishers: dict[int, set[int]] = {}
        """By subscription: the publishers that it is attached to, suspended ones included."""

    def add_reader(self, subscription: int, reader: Reader) -> None:
        """Register a subscription under its id."""
        self._readers[subscription] = reader

    def remove_reader(self, subscription: int) -> None:
        """Remove a subscription; it gets nothing more."""
        reader = self._readers.pop(subscription, None)
        publishers = self._publishers.pop(subscription, ())
        if reader is not None:
            for publisher in publishers:
                _remove(self._attachments, publisher, reader)
                _remove(self._suspended, publisher, reader)

    def attached(self, frame: frames.Attached) -> None:
        """Handle ATTACHED."""
        for subscription in frame.subscriptions:
            reader = self._readers.get(subscription)
            if reader is not None:
                # A broker that had suspended this node attaches again without a DETACHED.
                self._detach(frame.publisher, reader)
                self._end_suspension(frame.publisher, reader)
                attachment = Attachment(reader, frame)
                self._attachments.setdefault(frame.publisher, []).append(attachment)
                self._publishers.setdefault(subscription, set()).add(frame.publisher)
                reader.attached(attachment)

    def detached(self, frame: frames.Detached) -> None:
        """Handle DETACHED."""
        suspended = frame.reason == DetachReason.SUSPENDED
        for subscription in frame.subscriptions:
            reader = self._readers.get(subscription)
            if reader is None:
                continue
            if not suspended:
                self._end_suspension(frame.publisher, reader)
                self._publishers.get(subscription, set()).discard(frame.publisher)
            self._detach(frame.publisher, reader, suspended=suspended)

    def _detach(self, publisher: int, reader: Reader, *, suspended: bool = False) -> None:
        for attachment in _remove(self._attachments, publisher, reader):
            if suspended:
                self._suspended.setdefault(publisher, []).append(attachment)
            reader.detached(attachment, suspended=suspended)

    def _end_suspension(self, publisher: int, reader: Reader) -> None:
        for _ in _remove(self._suspended, publisher, reader):
            reader.suspension_ended()

    def batch_received(self, batch: Batch) -> None:
        """Handle BATCH; ignore one for a publisher without attachments, which crossed an UNDECLARE."""
        # A copy: a callback that runs within `receive` may destroy its subscription, or another.
        for attachment in tuple(self._attachments.get(batch.publisher, ())):
            attachment.reader.receive(attachment, batch)

    def replay_received(self, replay: Replay) -> None:
        """Handle REPLAY: latched messages for one subscription."""
        reader = self._readers.get(replay.subscription)
        for attachment in tuple(self._attachments.get(replay.publisher, ())):
            if attachment.reader is reader:
                attachment.reader.receive(attachment, replay)

    def asserted(self, frame: frames.Assert) -> None:
        """Handle ASSERT: a publisher is alive."""
        for attachment in tuple(self._attachments.get(frame.publisher, ())):
            attachment.reader.asserted(attachment)


def _remove(attachments: dict[int, list[Attachment]], publisher: int, reader: Reader) -> list[Attachment]:
    """Remove and return a reader's attachments to a publisher."""
    of_publisher = attachments.get(publisher, [])
    taken = [attachment for attachment in of_publisher if attachment.reader is reader]
    if taken:
        others = [attachment for attachment in of_publisher if attachment.reader is not reader]
        if others:
            attachments[publisher] = others
        else:
            del attachments[publisher]
    return taken
