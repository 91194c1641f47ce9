"""Signs of life on a session: asked for when something depends on them, and only then."""

from __future__ import annotations

from actors.session.keepalive import Keepalive
from proto.liveness import PeerState

KEEPALIVE_S = 3.0
TICK_S = 0.5
PING = 8


class Session:
    """A session whose broker answers each PING, unless it is frozen."""

    def __init__(self) -> None:
        self.now = 0.0
        self.keepalive = Keepalive(self.now, KEEPALIVE_S)
        self.received = self.sent = 100
        self.pings = 0
        self.frozen = False

    def go_on(self, seconds: float, *, awaited: bool = False) -> float | None:
        """Let time pass; return after how long the broker was given up, None if it was not."""
        began = self.now
        while self.now < began + seconds:
            self.now += TICK_S
            finding = self.keepalive.check(self.now, self.received, self.sent, awaited=awaited)
            if finding is PeerState.SILENT:
                return self.now - began
            if finding is PeerState.PING_DUE:
                self.pings += 1
                self.sent += PING
            self.keepalive.checked(self.sent)
            if finding is PeerState.PING_DUE and not self.frozen:
                self.received += PING
        return None


def test_an_idle_link_is_left_alone() -> None:
    """After what its opening led to has been answered, a minute passes without a PING."""
    session = Session()
    session.go_on(5)
    before = session.pings
    assert session.go_on(55) is None
    assert session.pings == before
    assert session.go_on(30) is None
    assert session.pings == before + 1


def test_a_link_that_something_depends_on_gives_a_sign_every_second() -> None:
    """A third of the keepalive limit, whether or not the broker asks."""
    session = Session()
    assert session.go_on(30, awaited=True) is None
    assert 20 <= session.pings <= 30


def test_a_slow_reader_gives_signs_although_it_receives_much() -> None:
    """Bytes that come all the time do not keep it from sending its own."""
    session = Session()
    for _ in range(20):
        session.received += 1000
        session.go_on(TICK_S, awaited=True)
    assert session.pings >= 4


def test_a_frozen_broker_is_given_up_at_the_limit() -> None:
    """Within the keepalive limit and a tick."""
    session = Session()
    session.go_on(10, awaited=True)
    session.frozen = True
    taken = session.go_on(60, awaited=True)
    assert taken is not None
    assert taken <= KEEPALIVE_S + 2 * TICK_S


def test_what_was_sent_into_the_silence_makes_the_limit_hold() -> None:
    """A call of which nothing was heard: nobody needs to say that it waits."""
    session = Session()
    session.go_on(10)
    session.frozen = True
    session.sent += 50
    taken = session.go_on(60)
    assert taken is not None
    assert taken <= KEEPALIVE_S + 3 * TICK_S


def test_a_frozen_broker_on_which_nothing_depends_is_given_up_late() -> None:
    """Its next PING is due within a minute; from then on it is held to the limit."""
    session = Session()
    session.go_on(10)
    session.frozen = True
    taken = session.go_on(200)
    assert taken is not None
    assert 40 <= taken <= 70


def test_signs_that_cannot_leave_do_not_pile_up() -> None:
    """A full transport counts no bytes as sent: still one PING a third of the limit, not one a look."""
    keepalive, pings = Keepalive(0.0, KEEPALIVE_S), 0
    for tick in range(1, 61):
        finding = keepalive.check(tick * TICK_S, 1000 * tick, 100, awaited=True)
        pings += finding is PeerState.PING_DUE
        keepalive.checked(100)
    assert 25 <= pings <= 30
