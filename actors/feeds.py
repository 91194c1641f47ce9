"""Who on this link gets which publisher's runs.

The broker sends a publisher's run to a link once; the link hands it to each of its subscriptions that is
attached to the publisher. An `Inflow` is one such pair.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Protocol

from proto.codes import DetachReason

if TYPE_CHECKING:
    from proto import frames
    from proto.frames import Options, Replay, Run

MANUAL_BY_TOPIC: Final = 3
"""Its number in a QoS map."""


class Reader(Protocol):
    """A subscription, as the feeds see it."""

    def receive(self, inflow: Inflow, run: Run | Replay) -> None:
        """Take a run of a publisher that it is attached to."""
        ...

    def attached(self, inflow: Inflow) -> None:
        """A publisher's runs will come."""
        ...

    def detached(self, inflow: Inflow, *, silent: bool = False) -> None:
        """No more runs of this publisher. If it is only silent, `forgotten` follows when that is over."""
        ...

    def asserted(self, inflow: Inflow) -> None:
        """The publisher says that it is alive."""
        ...

    def forgotten(self, inflow: Inflow) -> None:
        """A publisher that was silent is attached anew, or has gone for good."""
        ...


class Inflow:
    """One publisher's runs for one subscription.

    Attributes:
        reader: The subscription.
        publisher: The publisher's id on this broker.
        gid: The publisher's id for good, also across reconnects.
        node: The publisher's node.
        lifespan_s: Seconds after which the publisher's messages are of no use; 0 for no limit.
        lease_s: Seconds within which a MANUAL_BY_TOPIC publisher shows itself; 0 for any other.
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


def _remove(inflows: dict[int, list[Inflow]], publisher: int, reader: Reader) -> None:
    """Take a reader's inflow of a publisher away; a publisher without any is forgotten."""
    of_publisher = inflows.get(publisher, [])
    others = [inflow for inflow in of_publisher if inflow.reader is not reader]
    if others:
        inflows[publisher] = others
    else:
        inflows.pop(publisher, None)


class Feeds:
    """The inflows of one link, by publisher."""

    def __init__(self) -> None:
        self._inflows: dict[int, list[Inflow]] = {}
        self._silent: dict[int, list[Inflow]] = {}
        """Of publishers that are suspended, those that have been detached: bounded by what was attached."""
        self._readers: dict[int, Reader] = {}
        self._heard_by: dict[int, set[int]] = {}
        """By subscription: the publishers that it has inflows of, silent ones included."""

    def __len__(self) -> int:
        """Return how many publishers are heard."""
        return len(self._inflows)

    def add_reader(self, subscription: int, reader: Reader) -> None:
        """Make a subscription known under its id."""
        self._readers[subscription] = reader

    def remove_reader(self, subscription: int) -> None:
        """Hand nothing more to a subscription."""
        reader = self._readers.pop(subscription, None)
        publishers = self._heard_by.pop(subscription, ())
        if reader is not None:
            for publisher in publishers:
                _remove(self._inflows, publisher, reader)
                _remove(self._silent, publisher, reader)

    def attached(self, frame: frames.Attached) -> None:
        """ATTACHED came."""
        for subscription in frame.subscriptions:
            reader = self._readers.get(subscription)
            if reader is not None:
                inflows = self._inflows.setdefault(frame.publisher, [])
                # A broker that took us for frozen attaches anew without a DETACHED.
                self._detach(inflows, reader)
                self._forget(frame.publisher, reader)
                inflow = Inflow(reader, frame)
                inflows.append(inflow)
                self._heard_by.setdefault(subscription, set()).add(frame.publisher)
                reader.attached(inflow)

    def detached(self, frame: frames.Detached) -> None:
        """DETACHED came."""
        inflows = self._inflows.get(frame.publisher, [])
        for subscription in frame.subscriptions:
            reader = self._readers.get(subscription)
            if reader is None:
                continue
            silent = frame.reason == DetachReason.SUSPENDED
            if not silent:
                self._forget(frame.publisher, reader)
                self._heard_by.get(subscription, set()).discard(frame.publisher)
            self._detach(inflows, reader, silent=silent)
        if not inflows:
            self._inflows.pop(frame.publisher, None)

    def _detach(self, inflows: list[Inflow], reader: Reader, *, silent: bool = False) -> None:
        for inflow in [inflow for inflow in inflows if inflow.reader is reader]:
            inflows.remove(inflow)
            if silent:
                self._silent.setdefault(inflow.publisher, []).append(inflow)
            reader.detached(inflow, silent=silent)

    def _forget(self, publisher: int, reader: Reader) -> None:
        silent = self._silent.get(publisher, [])
        for inflow in [inflow for inflow in silent if inflow.reader is reader]:
            silent.remove(inflow)
            reader.forgotten(inflow)
        if not silent:
            self._silent.pop(publisher, None)

    def run_received(self, run: Run) -> None:
        """RUN came. One for a publisher without inflows has crossed an UNDECLARE."""
        for inflow in tuple(self._inflows.get(run.publisher, ())):
            inflow.reader.receive(inflow, run)

    def replay_received(self, replay: Replay) -> None:
        """REPLAY came: latched messages for one subscription."""
        reader = self._readers.get(replay.subscription)
        for inflow in tuple(self._inflows.get(replay.publisher, ())):
            if inflow.reader is reader:
                inflow.reader.receive(inflow, replay)

    def clear(self) -> None:
        """The session is over."""
        inflows, self._inflows = self._inflows, {}
        silent, self._silent = self._silent, {}
        self._heard_by.clear()
        for flow in [flow for flows in silent.values() for flow in flows]:
            flow.reader.forgotten(flow)
        for flow in [flow for flows in inflows.values() for flow in flows]:
            flow.reader.detached(flow)

    def asserted(self, frame: frames.Assert) -> None:
        """ASSERT came: a publisher is alive."""
        for inflow in tuple(self._inflows.get(frame.publisher, ())):
            inflow.reader.asserted(inflow)
