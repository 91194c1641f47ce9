"""Detection of silent peers: when a PING is due, and when a peer counts as silent."""

from __future__ import annotations

from proto.liveness import Liveness, PeerState

LIMIT_S = 3.0


def check_at(liveness: Liveness, times: list[float], received: int = 0) -> list[PeerState]:
    """Check at each of these times, without new bytes."""
    return [liveness.check(now, received, LIMIT_S) for now in times]


def test_a_peer_that_does_not_answer_one_ping_is_silent() -> None:
    """The PING is due after a third of the limit; at the limit the peer is silent."""
    found = check_at(Liveness(0.0), [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5])
    alive, ping_due, silent = PeerState.ALIVE, PeerState.PING_DUE, PeerState.SILENT
    assert found == [alive, ping_due, alive, alive, alive, alive, silent]


def test_any_bytes_restart_the_limit() -> None:
    """An answer, or any other bytes, give the peer the whole limit again."""
    liveness = Liveness(0.0)
    assert liveness.check(1.0, 0, LIMIT_S) is PeerState.PING_DUE
    assert liveness.check(2.9, 1, LIMIT_S) is PeerState.ALIVE
    assert liveness.last_seen_at == 2.9
    assert liveness.check(3.8, 1, LIMIT_S) is PeerState.ALIVE
    assert liveness.check(3.9, 1, LIMIT_S) is PeerState.PING_DUE


def test_a_peer_without_a_ping_is_not_silent() -> None:
    """After the limit becomes shorter, a PING is sent first, however long the peer has been silent."""
    liveness = Liveness(0.0)
    assert liveness.check(50.0, 0, 180.0) is PeerState.ALIVE
    assert liveness.check(50.5, 0, LIMIT_S) is PeerState.PING_DUE
    assert liveness.check(52.0, 0, LIMIT_S) is PeerState.ALIVE
    assert liveness.check(52.6, 0, LIMIT_S) is PeerState.SILENT
