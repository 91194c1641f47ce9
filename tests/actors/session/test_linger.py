"""Which messages wait for others."""

from __future__ import annotations

from actors.session.link import LINGER_BYTES, LINGER_SEC, Linger


def after_others() -> Linger:
    """Return one whose last messages were sent at time 0."""
    linger = Linger()
    linger.add(1, 0.0)
    linger.end(0.0)
    return linger


def test_a_message_after_a_pause_leaves_at_once() -> None:
    """The first one, and one that comes later than the longest wait."""
    first = Linger()
    first.add(1, 0.0)
    assert not first.goes_on(0.0)
    late = after_others()
    late.add(1, LINGER_SEC)
    assert not late.goes_on(LINGER_SEC)


def test_messages_wait_as_long_as_each_turn_adds_one() -> None:
    """A turn without one ends it."""
    linger = after_others()
    for _ in range(3):
        linger.add(1, LINGER_SEC / 2)
        assert linger.goes_on(LINGER_SEC / 2)
    assert linger.size == 3
    assert not linger.goes_on(LINGER_SEC / 2)


def test_the_wait_has_limits() -> None:
    """In time, from the first one on, and in bytes."""
    linger = after_others()
    linger.add(1, LINGER_SEC / 2)
    linger.add(1, LINGER_SEC * 0.9)
    assert not linger.goes_on(LINGER_SEC * 1.5)
    linger = after_others()
    linger.add(LINGER_BYTES - 1, 0.0)
    assert linger.goes_on(0.0)
    linger.add(1, 0.0)
    assert not linger.goes_on(0.0)
