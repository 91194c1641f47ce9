"""Delays before restarts."""

from __future__ import annotations

from actors.processes.backoff import Backoff


def test_delays_grow_up_to_the_longest() -> None:
    """By their factor; a long life or a reset makes them begin anew."""
    backoff = Backoff(0.5, 3.0, factor=2.0)
    assert [backoff.next(0.0) for _ in range(5)] == [0.5, 1.0, 2.0, 3.0, 3.0]
    assert backoff.next(5.9) == 3.0
    assert [backoff.next(6.0), backoff.next(0.0)] == [0.5, 1.0]
    backoff.reset()
    assert backoff.next(0.0) == 0.5


def test_a_delay_may_be_constant_or_nothing() -> None:
    """With a factor of 1, or from 0 on."""
    assert [Backoff(1.0, 9.0, factor=1.0).next(0.0) for _ in range(3)] == [1.0] * 3
    none = Backoff(0.0, 5.0)
    assert [none.next(0.0) for _ in range(3)] == [0.0] * 3
