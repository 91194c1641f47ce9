"""Steps at a rate."""

from __future__ import annotations

import pytest

from actors.cli.rate_limit import RateLimit


class Clock:
    """A time that the test sets."""

    now = 100.0

    def __call__(self) -> float:
        """Return it."""
        return self.now


def test_it_does_not_drift() -> None:
    """What a step takes is taken from the wait."""
    clock = Clock()
    limit = RateLimit(10.0, clock)
    for step in range(1, 50):
        clock.now += 0.03
        clock.now += limit.wait_sec()
        assert clock.now == pytest.approx(100.0 + step / 10)


def test_a_long_step_is_not_made_up_for_in_a_burst() -> None:
    """One step comes at once after it, and the next a period later."""
    clock = Clock()
    limit = RateLimit(10.0, clock)
    clock.now += 60.0
    assert limit.wait_sec() == 0.0
    assert limit.wait_sec() == pytest.approx(0.1)
