"""What one graph's mesh keeps about its exchange with one other broker, pure.

Messages between brokers may be lost when their route changes. Lost changes show by their version: the
broker's snapshot replaces them. Lost direct messages show by their number: both brokers forget what they know
of each other and begin a new epoch, as after a partition. Epochs are numbers that only increase: a broker
that sees a greater one than its own begins it, too, so that both agree. Heartbeats show what was lost last.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from broker.mesh.messages import Received

MAX_WAITING: Final = 10_000
"""Messages that wait for a broker's snapshot. The others are lost, which their numbers show."""


@dataclass(slots=True)
class BrokerSession:
    """The exchange with a broker that is alive.

    `sent`, `received`: direct messages in this epoch. `ready`: whether the broker's endpoints are known; if
    not, `waiting` has what has come since its snapshot was requested (`asked`).
    """

    epoch: int
    sent: int = 0
    received: int = 0
    ready: bool = False
    asked: bool = False
    waiting: list[Received] = field(default_factory=list["Received"])

    def begin(self, epoch: int) -> None:
        """Begin an epoch."""
        self.epoch = epoch
        self.sent = self.received = 0
        self.ready = False
        self.waiting.clear()

    def wait(self, message: Received) -> bool:
        """Keep a message until the snapshot has come; return False if it is lost."""
        if len(self.waiting) >= MAX_WAITING:
            return False
        self.waiting.append(message)
        return True
