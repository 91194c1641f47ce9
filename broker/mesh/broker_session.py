"""One graph's sessions with the other brokers of the mesh (none of them is a session of Zenoh).

Messages between brokers may be lost when their route changes. Lost changes show by their version: the
broker's snapshot replaces them. Lost direct messages show by their number: both brokers forget what they know
of each other and begin a new epoch, as after a partition. Epochs are numbers that only increase: a broker
that sees a greater one than its own begins it, too, so that both agree. Heartbeats show what was lost last.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from broker.mesh.messages import Direct, Heartbeat
from proto.wire import frames

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from collections.abc import Set as AbstractSet

    from broker.mesh.messages import Held, Received, Snapshot
    from proto.wire.frames import Frame

MAX_BROKERS: Final = 1000
"""Other brokers. Further ones are ignored."""

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
"""The size of their contents, beyond which the last one may be."""


@dataclass(slots=True)
class BrokerSession:
    """What is kept about the messages to and from a broker that is alive.

    Attributes:
        epoch: The current epoch.
        sent, received: Direct messages in this epoch.
        ready: Whether the broker's endpoints are known.
        asked: Whether its snapshot has been requested and not received.
        snapshot: Its snapshot, until the broker asks for this broker's.
        heartbeats: For how many heartbeats `snapshot` has been kept.
        waiting: Messages and their topics, received before the session was ready.
        waiting_bytes: The size of their contents.
        name, software: As in the broker's snapshot.
        stuck: By a publisher's number and next sequence number, in how many results of `stuck_publishers` in
            a row they were.
    """

    epoch: int
    sent: int = 0
    received: int = 0
    ready: bool = False
    asked: bool = False
    snapshot: Snapshot | None = None
    heartbeats: int = 0
    waiting: list[tuple[Received, str]] = field(default_factory=list["tuple[Received, str]"])
    waiting_bytes: int = 0
    name: str = ""
    software: str = ""
    stuck: dict[tuple[int, int], int] = field(default_factory=dict[tuple[int, int], int])

    def reset(self, epoch: int) -> None:
        """Begin an epoch, without what is known of the last one."""
        self.epoch = epoch
        self.sent = self.received = 0
        self.ready = False
        self.snapshot = None
        self.stuck = {}
        self.pop_waiting()

    def wait(self, message: Received, topic: str) -> bool:
        """Keep a message and its topic until the snapshot arrives; return False if it is dropped."""
        if len(self.waiting) >= MAX_WAITING or self.waiting_bytes > MAX_WAITING_BYTES:
            return False
        self.waiting.append((message, topic))
        self.waiting_bytes += _size(message)
        return True

    def overdue_snapshot(self) -> Snapshot | None:
        """Count a heartbeat; return the snapshot if it has waited for too many, else None."""
        self.heartbeats += self.snapshot is not None
        return self.snapshot if self.heartbeats > MAX_SNAPSHOT_HEARTBEATS else None

    def is_stuck(self, stuck: AbstractSet[tuple[int, int]]) -> bool:
        """Return whether a publisher is in more than `STUCK_HEARTBEATS` results of `stuck_publishers`."""
        self.stuck = {each: self.stuck.get(each, 0) + 1 for each in stuck}
        return any(count > STUCK_HEARTBEATS for count in self.stuck.values())

    def pop_waiting(self) -> list[tuple[Received, str]]:
        """Remove and return the messages that wait, each with its topic."""
        waiting, self.waiting = self.waiting, []
        self.waiting_bytes = 0
        return waiting


class BrokerSessions:
    """The sessions with all brokers that are alive.

    Args:
        emit: Takes each direct message.
    """

    def __init__(self, emit: Callable[[Direct], None]) -> None:
        self._emit = emit
        self._sessions: dict[int, BrokerSession] = {}
        self._epochs: dict[int, int] = {}
        """By broker, the epoch of the last session with it, also if it is gone."""

    def __len__(self) -> int:
        return len(self._sessions)

    def __contains__(self, broker: int) -> bool:
        return broker in self._sessions

    @property
    def full(self) -> bool:
        """Whether there are as many as there may be."""
        return len(self._sessions) >= MAX_BROKERS

    def get(self, broker: int) -> BrokerSession | None:
        """Return the session with a broker; None if it is not alive."""
        return self._sessions.get(broker)

    def items(self) -> tuple[tuple[int, BrokerSession], ...]:
        """Return the numbers of the brokers, and the sessions with them."""
        return tuple(self._sessions.items())

    def names(self) -> dict[int, tuple[str, str]]:
        """Return the names and versions of the brokers by their numbers."""
        return {number: (each.name, each.software) for number, each in self._sessions.items()}

    def add(self, broker: int) -> BrokerSession:
        """Begin a session with a broker."""
        session = self._sessions[broker] = BrokerSession(0)
        self.reset(broker, session, self._epochs.pop(broker, 0) + 1)
        if len(self._epochs) > MAX_EPOCHS:
            del self._epochs[next(iter(self._epochs))]
        return session

    def remove(self, broker: int) -> bool:
        """End the session with a broker; return whether there was one."""
        return self._sessions.pop(broker, None) is not None

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
    if isinstance(frame, (frames.Batch, frames.Replay)):
        return len(frame.payload)
    if isinstance(frame, (frames.Request, frames.Reply)):
        return sum(len(entry.body) for entry in frame.entries)
    return 0
