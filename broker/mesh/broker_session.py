"""What one graph's mesh keeps about its exchange with one other broker, pure.

Messages between brokers may be lost when their route changes. Lost changes show by their version: the
broker's snapshot replaces them. Lost direct messages show by their number: both brokers forget what they know
of each other and begin a new epoch, as after a partition. Epochs are numbers that only increase: a broker
that sees a greater one than its own begins it, too, so that both agree. Heartbeats show what was lost last.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from proto import frames

if TYPE_CHECKING:
    from broker.mesh.messages import Received

MAX_WAITING: Final = 10_000
"""Messages that wait for a broker's snapshot. The others are lost, which their numbers show."""

MAX_WAITING_BYTES: Final = 16 * 1024 * 1024
"""The size of their contents, beyond which the last one may be."""


@dataclass(slots=True)
class BrokerSession:
    """The exchange with a broker that is alive.

    `sent`, `received`: direct messages in this epoch. `ready`: whether the broker's endpoints are known; if
    not, `waiting` has what has come since its snapshot was requested (`asked`). `name`, `software`: as in it.
    """

    epoch: int
    sent: int = 0
    received: int = 0
    ready: bool = False
    asked: bool = False
    waiting: list[Received] = field(default_factory=list["Received"])
    waiting_bytes: int = 0
    name: str = ""
    software: str = ""

    def begin(self, epoch: int) -> None:
        """Begin an epoch."""
        self.epoch = epoch
        self.sent = self.received = 0
        self.ready = False
        self.take_waiting()

    def wait(self, message: Received) -> bool:
        """Keep a message until the snapshot has come; return False if it is lost."""
        if len(self.waiting) >= MAX_WAITING or self.waiting_bytes > MAX_WAITING_BYTES:
            return False
        self.waiting.append(message)
        self.waiting_bytes += _size(message)
        return True

    def take_waiting(self) -> list[Received]:
        """Remove and return the messages that wait."""
        waiting, self.waiting = self.waiting, []
        self.waiting_bytes = 0
        return waiting


def _size(message: Received) -> int:
    frame = message if isinstance(message, (frames.Batch, frames.Assert)) else message.frame
    if isinstance(frame, (frames.Batch, frames.Replay)):
        return len(frame.payload)
    if isinstance(frame, (frames.Request, frames.Reply)):
        return sum(len(entry.body) for entry in frame.entries)
    return 0
