"""One graph's sessions with the other brokers of the mesh (none of them is a session of Zenoh).

Messages between brokers may be lost when their route changes. Lost changes show by their version: the
broker's snapshot replaces them. Lost direct messages show by their number: both brokers forget what they know
of each other and begin a new epoch, as after a partition. Epochs are numbers that only increase: a broker
that sees a greater one than its own begins it, too, so that both agree. Heartbeats show what was lost last.
"""

from __future__ import annotations

from collections import OrderedDict, deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from broker.mesh.messages import Direct, Heartbeat
from proto.wire import frames
from proto.wire.fragments import ByteTotal

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from collections.abc import Set as AbstractSet

    from broker.mesh.messages import Held, Received, Snapshot
    from proto.wire.frames import Frame

MAX_BROKERS: Final = 1000
"""Other brokers that have answered. Further ones are ignored."""

MAX_UNANSWERED: Final = 1000
"""Brokers that have announced themselves and not answered yet. Beyond it the one that has failed to answer
longest is given up until its next heartbeat, so that those who announce many keep nobody out."""

QUICK_ASKS: Final = 5
"""Requests in a row that a broker may leave unanswered before it is asked less often.

Zenoh may not know a route yet to one that has just joined."""

MAX_QUICKLY_ASKED: Final = 100
"""Brokers that have not answered, beyond which none is asked at once: each request takes 0.1 ms."""

MAX_UNHEARD_FIRST: Final = 5
"""Heartbeats after which a broker is asked then, if none of its own has come before."""

MAX_UNHEARD: Final = 15
"""Heartbeats after which a request counts as lost: the engine says earlier that there is no answer."""

MAX_SILENT: Final = 15
"""Heartbeats without one of a broker whose token has not been seen, after which it counts as gone."""

MAX_PAUSE: Final = 32
"""Heartbeats after which a broker that has left many requests unanswered is asked again, at most."""

MAX_GIVEN_UP: Final = 10_000
"""Brokers that were given up and are remembered, so that a heartbeat of theirs brings them back."""

MAX_EPOCHS: Final = 10_000
"""Brokers, gone ones included, whose last epoch is remembered."""

MAX_SNAPSHOT_HEARTBEATS: Final = 2
"""Heartbeats, one a second, for which a broker's snapshot waits until it asks for this broker's.

A program that has not asked by then counts as one that needs none."""

STUCK_HEARTBEATS: Final = 4
"""Heartbeats, one a second, in a row in which a publisher may wait for granted credit.

The credit may be on its way."""

MAX_WAITING: Final = 10_000
"""Messages that wait for a broker's snapshot. The others are lost, which their numbers show."""

MAX_WAITING_BYTES: Final = 16 * 1024 * 1024
"""Their memory, beyond which the last one may be."""

MAX_TOTAL_BYTES: Final = 32 * 1024 * 1024
"""The same of all brokers in all graphs together, with snapshots that wait. Beyond it the brokers for which
most waits lose their messages, and their numbers of them show it. Snapshots that are being imported may take
as much, or a single one more."""

KEPT_BYTES: Final = MAX_TOTAL_BYTES * 3 // 4
"""What is kept then: finding those brokers takes long, and so must not be necessary for each message."""

SMALL_BYTES: Final = 64 * 1024
"""A smaller snapshot is received and imported whatever others take. That of most brokers is."""

OVERHEAD_BYTES: Final = 500
"""Memory of a message that waits, besides its content."""


class MeshMemory(ByteTotal):
    """The memory of what waits for snapshots of other brokers, in all graphs of this one.

    Attributes:
        importing: That of the snapshots that are being imported.
        expecting: Whether a snapshot that had no space has been requested again since a heartbeat.
        graphs: The sessions in each graph.
    """

    __slots__ = ("expecting", "graphs", "importing")

    def __init__(self) -> None:
        super().__init__()
        self.importing = 0
        self.expecting = False
        self.graphs: list[BrokerSessions] = []

    def begin_import(self, snapshot: Snapshot) -> bool:
        """Count a snapshot that is to be imported; return False if others take too much."""
        has_space = self._has_space(snapshot.size)
        self.importing += snapshot.size if has_space else 0
        return has_space

    def expect(self, size: int) -> bool:
        """Return whether to request a snapshot that had no space: when there is some, one at a heartbeat.

        Args:
            size: Its size; 0 for any other snapshot.
        """
        if size and (self.expecting or not self._has_space(size)):
            return False
        self.expecting |= size > 0
        return True

    def _has_space(self, size: int) -> bool:
        return not self.importing or size <= SMALL_BYTES or self.importing + size <= MAX_TOTAL_BYTES

    def shed(self) -> int:
        """Drop what waits for the brokers with most of it, if it is too much; return how many messages."""
        if self.bytes <= MAX_TOTAL_BYTES:
            return 0
        sessions = [session for graph in self.graphs for _, session in graph.items()]
        dropped = 0
        for session in sorted(sessions, key=lambda each: each.waiting_bytes, reverse=True):
            dropped += session.drop()
            if self.bytes <= KEPT_BYTES:
                break
        return dropped


@dataclass(slots=True)
class BrokerSession:
    """What is kept about the messages to and from a broker that is alive.

    Attributes:
        epoch: The current epoch.
        total: What waits for all brokers.
        sent, received: Direct messages in this epoch.
        ready: Whether the broker's endpoints are known.
        answered: Whether a snapshot of it has come: whether it counts as a broker.
        asked: Whether its snapshot has been requested and not received.
        failures: How many requests in a row it has left unanswered.
        pause: Heartbeats until it is asked again; 0 for none.
        unheard: For how many heartbeats the answer to a request has not come, nor that there is none.
        announced: Whether its token has been seen, so that its end will be, too.
        silent: Heartbeats of this broker since the last one of that.
        nudged: Whether its own heartbeat has led to a request since this broker's last one.
        sourced: Whether its samples name their source.
        snapshot: Its snapshot, until the broker asks for this broker's.
        importing: Whether its snapshot is being imported.
        postponed: The size of its snapshot that had no space beside others; 0 for none.
        heartbeats: For how many heartbeats `snapshot` has been kept.
        waiting: Messages and their topics, received before the session was ready.
        waiting_bytes: Their memory, and that of `snapshot`.
        name, software: As in the broker's snapshot.
        stuck: By a publisher's number and next sequence number, in how many results of `stuck_publishers` in
            a row they were.
    """

    epoch: int
    total: MeshMemory
    sent: int = 0
    received: int = 0
    ready: bool = False
    answered: bool = False
    asked: bool = False
    failures: int = 0
    pause: int = 0
    unheard: int = 0
    announced: bool = True
    silent: int = 0
    nudged: bool = False
    sourced: bool = False
    snapshot: Snapshot | None = None
    importing: bool = False
    postponed: int = 0
    heartbeats: int = 0
    waiting: deque[tuple[Received, str]] = field(default_factory=deque["tuple[Received, str]"])
    waiting_bytes: int = 0
    name: str = ""
    software: str = ""
    stuck: dict[tuple[int, int], int] = field(default_factory=dict[tuple[int, int], int])

    def reset(self, epoch: int) -> None:
        """Begin an epoch, without what is known of the last one."""
        self.epoch = epoch
        self.sent = self.received = 0
        self.ready = self.importing = False
        self.stuck = {}
        self.drop()

    def has_space(self, size: int) -> bool:
        """Return whether a message of a size may wait: a small one, or if there is not much of others."""
        return self.waiting_bytes + size <= SMALL_BYTES or self.total.bytes + size <= KEPT_BYTES

    def wait(self, message: Received, topic: str) -> bool:
        """Keep a message and its topic until the snapshot arrives; return False if it is dropped."""
        if len(self.waiting) >= MAX_WAITING or self.waiting_bytes > MAX_WAITING_BYTES:
            return False
        self.waiting.append((message, topic))
        self._count(_size(message))
        return True

    def _count(self, size: int) -> None:
        self.waiting_bytes += size
        self.total.bytes += size

    def keep(self, snapshot: Snapshot) -> None:
        """Keep a snapshot until the broker asks for this broker's."""
        self.pop_snapshot()
        self.snapshot, self.heartbeats = snapshot, 0
        self._count(snapshot.size)

    def pop_snapshot(self) -> Snapshot | None:
        """Remove and return the snapshot that waits, if any."""
        snapshot, self.snapshot = self.snapshot, None
        if snapshot is not None:
            self._count(-snapshot.size)
        return snapshot

    def fail(self, *, quick: bool) -> bool:
        """Note that a request got no answer; return whether to ask again at once, if that may be."""
        self.failures = self.failures + 1 if quick else max(self.failures + 1, QUICK_ASKS)
        if self.failures < QUICK_ASKS:
            return True
        self.pause = min(1 << min(self.failures - QUICK_ASKS, 10), MAX_PAUSE)
        return False

    def is_silent(self) -> bool:
        """Count a heartbeat; return whether the broker has gone without a token whose end would show it."""
        self.silent += 1
        return not self.announced and self.silent > MAX_SILENT

    def is_due(self) -> bool:
        """Count a heartbeat; return whether it is time to ask again."""
        self.nudged = False
        self.pause -= self.pause > 0
        self.unheard = self.unheard + 1 if self.asked else 0
        if self.unheard > MAX_UNHEARD:
            self.asked, self.unheard = False, 0
        return not (self.ready or self.asked or self.importing or self.snapshot or self.pause)

    def is_snapshot_overdue(self) -> bool:
        """Count a heartbeat; return whether the snapshot has waited for too many."""
        self.heartbeats += 1
        return self.snapshot is not None and self.heartbeats > MAX_SNAPSHOT_HEARTBEATS

    def is_stuck(self, stuck: AbstractSet[tuple[int, int]]) -> bool:
        """Return whether a publisher is in more than `STUCK_HEARTBEATS` results of `stuck_publishers`."""
        self.stuck = {each: self.stuck.get(each, 0) + 1 for each in stuck}
        return any(count > STUCK_HEARTBEATS for count in self.stuck.values())

    def next_waiting(self) -> tuple[Received, str]:
        """Remove and return the message that has waited longest, with its topic."""
        message, topic = self.waiting.popleft()
        self._count(-_size(message))
        return message, topic

    def wait_again(self, message: Received, topic: str) -> None:
        """Let a message wait before all others."""
        self.waiting.appendleft((message, topic))
        self._count(_size(message))

    def drop(self) -> int:
        """Drop what waits; return how many messages."""
        self.snapshot = None
        dropped = len(self.waiting)
        self.waiting.clear()
        self._count(-self.waiting_bytes)
        return dropped


class BrokerSessions:
    """The sessions with all brokers that are alive.

    Args:
        emit: Takes each direct message.
        memory: Counts what waits; that of the broker's other graphs.

    Attributes:
        memory: As given.
        given_up: Brokers that a heartbeat of theirs brings back, and whether they are announced: they did not
            answer when there were too many of those, or have gone silent or been rejected without a token.
        ignored: Messages that were not decoded: of brokers that are not alive, or too many before a snapshot.
    """

    def __init__(self, emit: Callable[[Direct], None], memory: MeshMemory) -> None:
        self._emit = emit
        self._sessions: dict[int, BrokerSession] = {}
        self.memory = memory
        self.given_up: dict[int, bool] = {}
        self.ignored = 0
        memory.graphs.append(self)
        self._unanswered: OrderedDict[int, None] = OrderedDict()
        """Brokers that have not answered yet. The next one to be given up comes first."""
        self._epochs: dict[int, int] = {}
        """By broker, the epoch of the last session with it, also if it is gone."""

    def __len__(self) -> int:
        return len(self._sessions)

    def __contains__(self, broker: int) -> bool:
        return broker in self._sessions

    @property
    def full(self) -> bool:
        """Whether there are as many that have answered as there may be."""
        return len(self._sessions) - len(self._unanswered) >= MAX_BROKERS

    @property
    def crowded(self) -> bool:
        """Whether so many have not answered that none is asked at once."""
        return len(self._unanswered) > MAX_QUICKLY_ASKED

    def get(self, broker: int) -> BrokerSession | None:
        """Return the session with a broker; None if it is not alive."""
        return self._sessions.get(broker)

    def admits(self, broker: int, size: int) -> bool:
        """Return whether to decode a message; if not, it counts as ignored.

        Args:
            broker: The sender.
            size: Its bytes.
        """
        session = self._sessions.get(broker)
        admitted = session is not None and (session.answered or session.has_space(size))
        self.ignored += not admitted
        return admitted

    def has_seen(self, broker: int) -> bool:
        """Return whether there is or was a session with a broker, as far as is remembered."""
        return broker in self._epochs

    def is_sourced(self, broker: int) -> bool:
        """Return whether the samples of a broker name their source: others are somebody else's."""
        session = self._sessions.get(broker)
        return session is not None and session.sourced

    def items(self) -> tuple[tuple[int, BrokerSession], ...]:
        """Return the numbers of the brokers, and the sessions with them."""
        return tuple(self._sessions.items())

    def names(self) -> dict[int, tuple[str, str]]:
        """Return the names and versions of the brokers that have answered, by their numbers."""
        sessions = self._sessions.items()
        return {number: (each.name, each.software) for number, each in sessions if each.answered}

    def add(self, broker: int) -> BrokerSession:
        """Begin a session with a broker."""
        session = self._sessions[broker] = BrokerSession(0, self.memory)
        self._unanswered[broker] = None
        self.reset(broker, session, self._epochs.pop(broker, 0) + 1)
        if len(self._epochs) > MAX_EPOCHS:
            del self._epochs[next(iter(self._epochs))]
        return session

    def surplus(self) -> int | None:
        """Return a broker to give up, because too many have not answered; None if they are not too many."""
        return next(iter(self._unanswered)) if len(self._unanswered) > MAX_UNANSWERED else None

    def give_up(self, broker: int, session: BrokerSession) -> None:
        """Remember a broker that is forgotten until it sends a heartbeat."""
        self.given_up[broker] = session.announced
        if len(self.given_up) > MAX_GIVEN_UP:
            del self.given_up[next(iter(self.given_up))]

    def answer(self, broker: int, session: BrokerSession) -> None:
        """Note that a broker has answered."""
        session.answered, session.failures, session.pause, session.nudged = True, 0, 0, False
        self._unanswered.pop(broker, None)

    def fail(self, broker: int, session: BrokerSession) -> bool:
        """Note that a broker has left a request unanswered; return whether to ask again at once."""
        again = session.fail(quick=not self.crowded)
        if not again and broker in self._unanswered:
            self._unanswered.move_to_end(broker, last=False)
        return again

    def expect(self, broker: int, session: BrokerSession) -> bool:
        """Return whether to request a broker's snapshot now; not if there is no space for it."""
        if not self.memory.expect(session.postponed):
            return False
        if session.postponed:  # next time the others come first: this one may not answer again and again
            self._sessions[broker] = self._sessions.pop(broker)
        return True

    def postpone(self, broker: int, session: BrokerSession) -> None:
        """Ask a broker again later, because there are too many."""
        session.failures = MAX_PAUSE
        self.fail(broker, session)

    def remove(self, broker: int) -> bool:
        """End the session with a broker; return whether there was one."""
        self._unanswered.pop(broker, None)
        session = self._sessions.pop(broker, None)
        if session is not None:
            session.drop()
        return session is not None

    def reset(self, broker: int, session: BrokerSession, epoch: int) -> None:
        """Begin an epoch, without what is known of the last one."""
        session.reset(epoch)
        self._epochs[broker] = epoch

    def rename(self, broker: int, session: BrokerSession, epoch: int) -> None:
        """Give an epoch in which nothing has been sent another number."""
        session.epoch = self._epochs[broker] = epoch

    def direct(self, broker: int, frame: Frame, endpoint: int = 0) -> None:
        """Send a frame to a broker, if it is alive.

        Args:
            broker: The broker.
            frame: The frame.
            endpoint: As in `Direct`.
        """
        session = self._sessions.get(broker)
        if session is not None:
            session.sent += 1
            self._emit(Direct(broker, session.epoch, session.sent, endpoint, frame))

    def heartbeat(self, version: int, held: Mapping[int, Held]) -> Heartbeat:
        """Return a heartbeat with the version of this broker's changes, and its held publishers."""
        sent = {broker: (each.epoch, each.sent) for broker, each in self._sessions.items()}
        return Heartbeat(version, sent, held)


def _size(message: Received) -> int:
    frame = message if isinstance(message, (frames.Batch, frames.Assert)) else message.frame
    size = OVERHEAD_BYTES
    if isinstance(frame, (frames.Batch, frames.Replay)):
        size += len(frame.payload)
    elif isinstance(frame, (frames.Request, frames.Reply)):
        size += sum(len(entry.body) for entry in frame.entries)
    return size
