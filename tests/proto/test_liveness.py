"""Signs of life: who is asked when, and who is taken for gone."""

from __future__ import annotations

from proto.liveness import Liveness, PeerState

LIMIT_S = 3.0


def look_every(liveness: Liveness, times: list[float], received: int = 0) -> list[PeerState]:
    """Look at each of these times; nothing new comes."""
    return [liveness.check(now, received, LIMIT_S) for now in times]


def test_a_silent_peer_is_asked_once_and_then_given_up() -> None:
    """It is asked after a third of the limit and is silent when the limit has passed without an answer."""
    found = look_every(Liveness(0.0), [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5])
    fine, ask, silent = PeerState.ALIVE, PeerState.PING_DUE, PeerState.SILENT
    assert found == [fine, ask, fine, fine, fine, fine, silent]


def test_any_bytes_start_anew() -> None:
    """An answer, or anything else, gives it the whole time again."""
    liveness = Liveness(0.0)
    assert liveness.check(1.0, 0, LIMIT_S) is PeerState.PING_DUE
    assert liveness.check(2.9, 1, LIMIT_S) is PeerState.ALIVE
    assert liveness.heard_at == 2.9
    assert liveness.check(3.8, 1, LIMIT_S) is PeerState.ALIVE
    assert liveness.check(3.9, 1, LIMIT_S) is PeerState.PING_DUE


def test_a_peer_that_nobody_asked_is_not_given_up() -> None:
    """A limit that becomes shorter first has the peer asked, however long it has been silent."""
    liveness = Liveness(0.0)
    assert liveness.check(50.0, 0, 180.0) is PeerState.ALIVE
    assert liveness.check(50.5, 0, LIMIT_S) is PeerState.PING_DUE
    assert liveness.check(52.0, 0, LIMIT_S) is PeerState.ALIVE
    assert liveness.check(52.6, 0, LIMIT_S) is PeerState.SILENT
