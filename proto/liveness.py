"""How long a peer has been silent, and when to ask whether it is there. Pure: time is an argument.

Any bytes are a sign of life, so the owner looks from time to time at how many have come: no clock is read
when they do. A peer is silent only when it has been asked and has not answered: one that nobody asked may
sleep.
"""

from __future__ import annotations

from enum import Enum


class PeerState(Enum):
    """What a look at a peer tells its owner to do."""

    ALIVE = "alive"
    PING_DUE = "ping due"
    """Send a PING."""
    SILENT = "silent"


class Liveness:
    """One peer's signs of life.

    Attributes:
        heard_at: When a look last found that bytes had come.
    """

    __slots__ = ("_asked_at", "_seen_bytes", "heard_at")

    def __init__(self, now: float) -> None:
        self.heard_at = now
        self._seen_bytes = 0
        self._asked_at: float | None = None

    def silent_s(self, now: float, bytes_received: int) -> float:
        """Return how long ago a look has found bytes; 0 if more have come since the last look."""
        return 0.0 if bytes_received != self._seen_bytes else max(0.0, now - self.heard_at)

    def check(self, now: float, bytes_received: int, limit_s: float) -> PeerState:
        """Judge a peer that may be silent for `limit_s`, and from which so many bytes have come so far.

        It is asked after a third of that, and has the rest to answer.
        """
        if bytes_received != self._seen_bytes:
            self._seen_bytes = bytes_received
            self.heard_at = now
            self._asked_at = None
        elif self._asked_at is None:
            if now - self.heard_at >= limit_s / 3:
                self._asked_at = now
                return PeerState.PING_DUE
        elif now - self._asked_at > limit_s * 2 / 3:
            return PeerState.SILENT
        return PeerState.ALIVE
