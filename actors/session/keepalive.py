"""Signs of life on a session, in both directions: when to send a PING, and when the broker counts as gone.

While nothing here depends on the broker, an idle link exchanges nothing. As soon as something does (an
endpoint is matched, something waits, or the broker may not have received what was sent) the keepalive limit
holds. Then this end sends signs of life without being asked: behind much data that it reads slowly, the
broker's question would arrive late.
"""

from __future__ import annotations

from proto import limits
from proto.liveness import Liveness, PeerState


class Keepalive:
    """The keepalive of one session. Pure: times and byte counts are arguments.

    Attributes:
        limit_s: How long the broker may be silent, as of the last check.
    """

    def __init__(self, now: float, keepalive_s: float) -> None:
        self.limit_s = keepalive_s
        self._keepalive_s = keepalive_s
        self._liveness = Liveness(now)
        self._sent_bytes = 0
        self._sent_at = now
        self._checked_bytes = 0
        """Bytes sent until the end of the last check."""
        self._received_bytes = 0
        """Bytes that the broker must have received: sent before it last gave a sign of life."""

    def check(self, now: float, bytes_received: int, bytes_sent: int, *, awaited: bool) -> PeerState:
        """Return what to do; call `checked` when that is done.

        Args:
            now: The loop's time.
            bytes_received: Bytes received since the session began.
            bytes_sent: Bytes sent since the session began.
            awaited: Whether something here depends on the broker.
        """
        relies = awaited or bytes_sent != self._received_bytes
        self.limit_s = self._keepalive_s if relies else max(self._keepalive_s, limits.IDLE_KEEPALIVE_SEC)
        finding = self._liveness.check(now, bytes_received, self.limit_s)
        if self._liveness.last_seen_at == now:
            self._received_bytes = self._checked_bytes
        if bytes_sent != self._sent_bytes:
            self._sent_bytes, self._sent_at = bytes_sent, now
        if finding is PeerState.ALIVE and relies and now - self._sent_at >= self._keepalive_s / 3:
            self._sent_at = now  # a full transport takes no bytes: one sign of life is enough
            return PeerState.PING_DUE
        return finding

    def checked(self, bytes_sent: int) -> None:
        """End the check, after sending what it led to."""
        self._checked_bytes = bytes_sent
