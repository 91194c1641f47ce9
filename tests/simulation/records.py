"""Records of a simulated history, and the checks made when they are written."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import actors
from actors.endpoints.endpoint import endpoint_of
from actors.qos.compatibility import disagreements
from proto.wire.frames import Replay
from tests.seams import simulation as seams

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actors.endpoints.subscription.subscription import Subscription
    from actors.session.attachments import Attachment
    from proto.wire.frames import Batch


class Note(actors.Message, type_name="simulation/msg/Note"):
    """What publishers publish: who, which, and some weight."""

    source: str = ""
    number: int = 0
    weight: bytes = b""


class Ask(actors.Service, type_name="simulation/srv/Ask"):
    """What clients ask; the answer is twice the number, after that many seconds."""

    class Request(actors.Message):
        caller: str = ""
        number: int = 0
        seconds: float = 0.0
        hops: int = 0
        weight: bytes = b""

    class Response(actors.Message):
        number: int = 0
        weight: bytes = b""


def match(pub: PublisherHistory, sub: SubscriptionHistory) -> bool:
    """Return whether a publisher and a subscription of one topic match: strict ones need compatible QoS."""
    strict = seams.is_strict(pub.publisher, sub.subscription)
    return not (strict and disagreements(pub.publisher.qos_profile, sub.subscription.qos_profile))


def keep_all(qos: actors.QoSProfile) -> bool:
    """Whether a profile promises to drop nothing, however long it takes."""
    kept = qos.history is actors.HistoryPolicy.KEEP_ALL and qos.lifespan.nanoseconds == 0
    return kept and qos.reliability is actors.ReliabilityPolicy.RELIABLE


@dataclass(eq=False)
class PublisherHistory:
    """One publisher's history."""

    name: str
    publisher: actors.Publisher[Note]
    gone: bool = False
    resent: int = 0
    """Messages queued a second time, for a broker that may not have them."""

    def __post_init__(self) -> None:
        queue = endpoint_of(self.publisher).queue

        def recording(resend: Callable[[], None]) -> Callable[[], None]:
            def recording_resend() -> None:
                before = queue.pending
                resend()
                self.resent += queue.pending - before

            return recording_resend

        seams.wrap_resend(self.publisher, recording)

    @property
    def published(self) -> int:
        """Messages published."""
        return self.publisher.published

    @property
    def latched(self) -> int:
        """Messages that a late joiner gets."""
        qos = self.publisher.qos_profile
        if qos.durability is not actors.DurabilityPolicy.TRANSIENT_LOCAL:
            return 0
        depth = 1000 if qos.history is actors.HistoryPolicy.KEEP_ALL else qos.depth
        return min(depth, self.published)


@dataclass(eq=False)
class SubscriptionHistory:
    """One subscription's history: what came, in which order, and from where it should have come.

    Attributes:
        first: By publisher gid, the sequence number from which live messages had to come.
        numbers: By publisher name, the numbers of the messages received.
        early: By publisher gid, latched messages from before `first` that have come.
        ends: By publisher gid, the number up to which all have come, or are counted where they were lost.
        moved: Whether something has come since its sums were checked.
        before: By publisher name, the number up to which a broker had had messages when it was made: if it
            is VOLATILE, those are not for it, whatever brings them again.
    """

    name: str
    complain: Callable[[str], None]
    clock: Callable[[], float]
    subscription: Subscription[Note]
    gone_at: float = math.inf
    first: dict[bytes, int] = field(default_factory=dict)
    numbers: dict[str, list[int]] = field(default_factory=dict)
    early: dict[bytes, set[int]] = field(default_factory=dict)
    ends: dict[bytes, int] = field(default_factory=dict)
    moved: bool = False
    before: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        attached, receive = endpoint_of(self.subscription).attached, endpoint_of(self.subscription).receive

        def recording_attached(attachment: Attachment) -> None:
            self.first.setdefault(attachment.gid, attachment.first_sequence)
            self.moved = True
            attached(attachment)
            self.first[attachment.gid] = min(self.first[attachment.gid], attachment.due)
            self.ends[attachment.gid] = attachment.expected

        def recording_receive(attachment: Attachment, batch: Batch | Replay) -> None:
            self.moved = True
            if attachment.current:
                seen = attachment.received if isinstance(batch, Replay) else attachment.expected
                start = max(batch.first_sequence, seen)
                end = min(batch.first_sequence + batch.length, self.first[attachment.gid])
                self.early.setdefault(attachment.gid, set()).update(range(start, end))
            receive(attachment, batch)
            if attachment.current:
                self.ends[attachment.gid] = attachment.expected

        endpoint_of(self.subscription).attached = recording_attached  # type: ignore[method-assign]
        endpoint_of(self.subscription).receive = recording_receive  # type: ignore[method-assign]

    @property
    def gone(self) -> bool:
        """Whether its process, or it, has ended."""
        return self.gone_at < math.inf

    @property
    def about_to_take(self) -> bool:
        """Whether an idle iterator has been woken, and takes what has come in its next step."""
        waiter = endpoint_of(self.subscription).consumer.waiter
        return waiter is not None and waiter.done()

    @property
    def due(self) -> int:
        """Messages that its inflows have covered so far: each has come, or is counted where it was lost."""
        return sum(self.ends[gid] - first + len(self.early.get(gid, ())) for gid, first in self.first.items())

    def leave(self) -> None:
        """Nothing more should come."""
        self.gone_at = self.clock()

    def record(self, message: Note, info: actors.MessageInfo | None) -> None:
        """A message has come: complain unless it is newer than everything received from its publisher."""
        numbers = self.numbers.setdefault(message.source, [])
        if numbers and message.number <= numbers[-1]:
            what = "again" if message.number in numbers else "late"
            self.complain(
                f"{self.name} receives {message.source} #{message.number} {what}, after #{numbers[-1]}"
            )
        if message.number < self.before.get(message.source, 0):
            self.complain(f"{self.name} receives {message.source} #{message.number}, from before it was made")
        if self.clock() > self.gone_at:
            # Not at the very moment: a coroutine callback that has been called may still begin.
            self.complain(f"{self.name} receives {message.source} #{message.number} after it has gone")
        numbers.append(message.number)
        if info is not None and info.publication_sequence_number != message.number:
            self.complain(f"{message.source} #{message.number} has number {info.publication_sequence_number}")


@dataclass(eq=False)
class CallHistory:
    """One call's history."""

    name: str
    number: int
    began: float
    timeout: float
    ended: float | None = None
    outcome: str = ""


@dataclass
class Journal:
    """Everything that happened in one history."""

    complaints: list[str] = field(default_factory=list)
    publishers: list[PublisherHistory] = field(default_factory=list)
    subscriptions: list[SubscriptionHistory] = field(default_factory=list)
    calls: list[CallHistory] = field(default_factory=list)
    reached: dict[tuple[str, bytes], int] = field(default_factory=dict)
    """By broker URL and publisher gid, the number after the last message that this broker has had."""
    struck: Counter[str] = field(default_factory=Counter)
    handled: dict[tuple[str, int], int] = field(default_factory=dict)
    given_up: dict[tuple[str, int], float] = field(default_factory=dict)
    events: list[str] = field(default_factory=list)

    def past(self, qos: actors.QoSProfile, broker: str) -> dict[str, int]:
        """Return, by publisher name, up to which number messages are not for a subscription made now.

        Only the subscription's own broker counts: a frozen link may bring it old messages of a publisher
        that has moved to another broker.
        """
        if qos.durability is actors.DurabilityPolicy.TRANSIENT_LOCAL:
            return {}
        return {pub.name: self.reached.get((broker, pub.publisher.gid), 0) for pub in self.publishers}

    def handle(self, caller: str, number: int) -> None:
        """A handler has begun to work on a call: at most once."""
        self.handled[caller, number] = self.handled.get((caller, number), 0) + 1
        if self.handled[caller, number] > 1:
            self.complaints.append(
                f"call {number} of {caller} was handled {self.handled[caller, number]} times"
            )
