"""Detection of silent peers (docs/protocol.md §4.3).

Any received byte is a sign of life. The owner therefore checks the number of received bytes periodically, and
no clock is read when they arrive. A peer counts as silent only after it has not answered a PING.
"""

from __future__ import annotations

from enum import Enum


class PeerState(Enum):
    """The result of a check."""

    ALIVE = "alive"
    PING_DUE = "ping due"
    """The peer has been silent for a third of the limit: send a PING."""
    SILENT = "silent"


class Liveness:
    """The signs of life of one peer.

    Attributes:
        last_seen_at: The time of the last check that found new bytes.
    """

    __slots__ = ("_asked_at", "_seen_bytes", "last_seen_at")

    def __init__(self, now: float) -> None:
        self.last_seen_at = now
        self._seen_bytes = 0
        self._asked_at: float | None = None

    def silent_s(self, now: float, bytes_received: int) -> float:
        """Return the seconds since a check found new bytes; 0 if there are new ones since the last check."""
        return 0.0 if bytes_received != self._seen_bytes else max(0.0, now - self.last_seen_at)

    def mark_alive(self, now: float) -> None:
        """Note a sign of life other than new bytes: bytes received before that have not been handled yet."""
        self.last_seen_at = now
        self._asked_at = None

    def check(self, now: float, bytes_received: int, limit_s: float) -> PeerState:
        """Check for new bytes. The PING is due after a third of the limit; the rest is for the answer.

        Args:
            now: The time, in seconds of a monotonic clock.
            bytes_received: Bytes received from the peer so far.
            limit_s: Seconds for which the peer may be silent.
        """
        if bytes_received != self._seen_bytes:
            self._seen_bytes = bytes_received
            self.last_seen_at = now
            self._asked_at = None
        elif self._asked_at is None:
            if now - self.last_seen_at >= limit_s / 3:
                self._asked_at = now
                return PeerState.PING_DUE
        elif now - self._asked_at > limit_s * 2 / 3:
            return PeerState.SILENT
        return PeerState.ALIVE
