"""Both directions' signs of life on a session: when to send a PING, and when the broker is taken for gone.

While nothing here depends on the broker, an idle link is left alone. As soon as something does (an endpoint
is matched, somebody waits, or we have sent what the broker may not have heard) the keepalive limit holds.
Then signs of life of ours do not wait to be asked for: behind much that we are slow to read, the question
would come late.
"""

from __future__ import annotations

from proto import limits
from proto.liveness import Liveness, PeerState


class Keepalive:
    """One session's. Pure: times and byte counts are arguments.

    Attributes:
        limit_s: How long the broker may be silent, as of the last look.
    """

    def __init__(self, now: float, keepalive_s: float) -> None:
        self.limit_s = keepalive_s
        self._keepalive_s = keepalive_s
        self._liveness = Liveness(now)
        self._sent_bytes = 0
        self._sent_at = now
        self._looked_bytes = 0
        """What had been sent at the end of the last look."""
        self._heard_bytes = 0
        """The same of the last look before the broker was heard of: what it must have got."""

    def look(self, now: float, bytes_received: int, bytes_sent: int, *, waiting: bool) -> PeerState:
        """Say what to do, given how many bytes have come and gone so far; call `looked` when it is done.

        Args:
            now: The loop's time.
            bytes_received: Since the session began.
            bytes_sent: Since the session began.
            waiting: Whether something here depends on the broker.
        """
        relies = waiting or bytes_sent != self._heard_bytes
        self.limit_s = self._keepalive_s if relies else max(self._keepalive_s, limits.IDLE_KEEPALIVE_SEC)
        finding = self._liveness.check(now, bytes_received, self.limit_s)
        if self._liveness.heard_at == now:
            self._heard_bytes = self._looked_bytes
        if bytes_sent != self._sent_bytes:
            self._sent_bytes, self._sent_at = bytes_sent, now
        if finding is PeerState.ALIVE and relies and now - self._sent_at >= self._keepalive_s / 3:
            self._sent_at = now  # a full transport takes no bytes: one sign a time is enough
            return PeerState.PING_DUE
        return finding

    def looked(self, bytes_sent: int) -> None:
        """The look is over, and what it led to has been sent."""
        self._looked_bytes = bytes_sent
