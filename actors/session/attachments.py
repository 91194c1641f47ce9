"""Who on this link gets which publisher's runs.

The broker sends a publisher's run to a link once; the link hands it to each of its subscriptions that is
attached to the publisher. An `Attachment` is one such pair.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from proto.codes import DetachReason
from proto.qos import MANUAL_BY_TOPIC

if TYPE_CHECKING:
    from proto import frames
    from proto.frames import Batch, Options, Replay


class Reader(Protocol):
    """A subscription, as the feeds see it."""

    def receive(self, attachment: Attachment, batch: Batch | Replay) -> None:
        """Take a run of a publisher that it is attached to."""
        ...

    def attached(self, attachment: Attachment) -> None:
        """A publisher's runs will come."""
        ...

    def detached(self, attachment: Attachment, *, silent: bool = False) -> None:
        """No more runs of this publisher. If it is only silent, `forgotten` follows when that is over."""
        ...

    def asserted(self, attachment: Attachment) -> None:
        """The publisher says that it is alive."""
        ...

    def forgotten(self, attachment: Attachment) -> None:
        """A publisher that was silent is attached anew, or has gone for good."""
        ...


class Attachment:
    """One publisher's runs for one subscription.

    Attributes:
        reader: The subscription.
        publisher: The publisher's id on this broker.
        gid: The publisher's id for good, also across reconnects.
        node: The publisher's node.
        lifespan_s: Seconds after which the publisher's messages are of no use; 0 for no limit.
        lease_s: Seconds within which a MANUAL_BY_TOPIC publisher shows itself; 0 for any other.
        counts: Whether it is its publisher's inflow now; another is a leftover. Kept by the reader.
        watched: Whether somebody wants to know that a run has come; kept by the reader.
        first_sequence: Live runs are for this subscription from here on.
        expected: The next sequence number; anything below has been seen.
        due: The number of the first message that was for this subscription, over all attachments.
        received: The number after the last one that has come, latched ones included.
        missed: Messages counted as lost at the attachment; latched ones may still come.
        granted_sequence, granted_bytes: Credit given so far (KEEP_ALL).
        taken_bytes: Bytes of messages that callbacks have taken since the attachment.
        taken_sequence: The number after the last one that they have taken.
    """

    __slots__ = (
        "counts",
        "due",
        "expected",
        "first_sequence",
        "gid",
        "granted_bytes",
        "granted_sequence",
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
        self.node = attached.node
        self.lifespan_s = _seconds(attached.qos, "lifespan_ns")
        manual = attached.qos.get("liveliness") == MANUAL_BY_TOPIC
        self.lease_s = _seconds(attached.qos, "lease_ns") if manual else 0.0
        self.counts = False
        self.watched = False
        self.first_sequence = attached.first_sequence
        self.expected = attached.first_sequence
        self.missed = 0
        self.due = attached.first_sequence
        self.received = 0
        self.granted_sequence = 0
        self.granted_bytes = 0
        self.taken_bytes = 0
        self.taken_sequence = 0


def _seconds(qos: Options, key: str) -> float:
    """Return a time in a QoS map, in seconds; 0 if there is none."""
    value = qos.get(key, 0)
    return value / 1e9 if isinstance(value, int) and value > 0 else 0.0


def _remove(attachments: dict[int, list[Attachment]], publisher: int, reader: Reader) -> None:
    """Take a reader's inflow of a publisher away; a publisher without any is forgotten."""
    of_publisher = attachments.get(publisher, [])
    others = [attachment for attachment in of_publisher if attachment.reader is not reader]
    if others:
        attachments[publisher] = others
    else:
        attachments.pop(publisher, None)


class Attachments:
    """The inflows of one link, by publisher."""

    def __init__(self) -> None:
        self._attachments: dict[int, list[Attachment]] = {}
        self._silent: dict[int, list[Attachment]] = {}
        """Of publishers that are suspended, those that have been detached: bounded by what was attached."""
        self._readers: dict[int, Reader] = {}
        self._heard_by: dict[int, set[int]] = {}
        """By subscription: the publishers that it has inflows of, silent ones included."""

    def __len__(self) -> int:
        """Return how many publishers are heard."""
        return len(self._attachments)

    def add_reader(self, subscription: int, reader: Reader) -> None:
        """Make a subscription known under its id."""
        self._readers[subscription] = reader

    def remove_reader(self, subscription: int) -> None:
        """Hand nothing more to a subscription."""
        reader = self._readers.pop(subscription, None)
        publishers = self._heard_by.pop(subscription, ())
        if reader is not None:
            for publisher in publishers:
                _remove(self._attachments, publisher, reader)
                _remove(self._silent, publisher, reader)

    def attached(self, frame: frames.Attached) -> None:
        """ATTACHED came."""
        for subscription in frame.subscriptions:
            reader = self._readers.get(subscription)
            if reader is not None:
                attachments = self._attachments.setdefault(frame.publisher, [])
                # A broker that took us for frozen attaches anew without a DETACHED.
                self._detach(attachments, reader)
                self._forget(frame.publisher, reader)
                attachment = Attachment(reader, frame)
                attachments.append(attachment)
                self._heard_by.setdefault(subscription, set()).add(frame.publisher)
                reader.attached(attachment)

    def detached(self, frame: frames.Detached) -> None:
        """DETACHED came."""
        attachments = self._attachments.get(frame.publisher, [])
        for subscription in frame.subscriptions:
            reader = self._readers.get(subscription)
            if reader is None:
                continue
            silent = frame.reason == DetachReason.SUSPENDED
            if not silent:
                self._forget(frame.publisher, reader)
                self._heard_by.get(subscription, set()).discard(frame.publisher)
            self._detach(attachments, reader, silent=silent)
        if not attachments:
            self._attachments.pop(frame.publisher, None)

    def _detach(self, attachments: list[Attachment], reader: Reader, *, silent: bool = False) -> None:
        for attachment in [attachment for attachment in attachments if attachment.reader is reader]:
            attachments.remove(attachment)
            if silent:
                self._silent.setdefault(attachment.publisher, []).append(attachment)
            reader.detached(attachment, silent=silent)

    def _forget(self, publisher: int, reader: Reader) -> None:
        silent = self._silent.get(publisher, [])
        for attachment in [attachment for attachment in silent if attachment.reader is reader]:
            silent.remove(attachment)
            reader.forgotten(attachment)
        if not silent:
            self._silent.pop(publisher, None)

    def batch_received(self, batch: Batch) -> None:
        """BATCH came. One for a publisher without inflows has crossed an UNDECLARE."""
        for attachment in tuple(self._attachments.get(batch.publisher, ())):
            attachment.reader.receive(attachment, batch)

    def replay_received(self, replay: Replay) -> None:
        """REPLAY came: latched messages for one subscription."""
        reader = self._readers.get(replay.subscription)
        for attachment in tuple(self._attachments.get(replay.publisher, ())):
            if attachment.reader is reader:
                attachment.reader.receive(attachment, replay)

    def clear(self) -> None:
        """The session is over."""
        attachments, self._attachments = self._attachments, {}
        silent, self._silent = self._silent, {}
        self._heard_by.clear()
        for flow in [flow for flows in silent.values() for flow in flows]:
            flow.reader.forgotten(flow)
        for flow in [flow for flows in attachments.values() for flow in flows]:
            flow.reader.detached(flow)

    def asserted(self, frame: frames.Assert) -> None:
        """ASSERT came: a publisher is alive."""
        for attachment in tuple(self._attachments.get(frame.publisher, ())):
            attachment.reader.asserted(attachment)
