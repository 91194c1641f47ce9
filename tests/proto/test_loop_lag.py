"""Tests of the loop's lag: the last delay, and the longest of a minute."""

from __future__ import annotations

from proto.loop_lag import LoopLag
from tests.seams.protocol import kept_maxima


def test_without_records_there_is_no_lag() -> None:
    """Before the first record both values are zero."""
    lag = LoopLag()
    assert lag.last_sec == 0
    assert lag.longest_sec(5.0) == 0


def test_the_longest_of_the_last_minute() -> None:
    """A delay counts for a minute, to ten seconds, and is then forgotten."""
    lag = LoopLag()
    lag.record(100.0, 0.5)
    lag.record(100.5, 0.1)
    assert (lag.last_sec, lag.longest_sec(101.0)) == (0.1, 0.5)
    lag.record(140.0, 0.2)
    assert lag.longest_sec(160.0) == 0.5
    assert lag.longest_sec(171.0) == 0.2
    assert lag.longest_sec(1000.0) == 0


def test_it_does_not_grow() -> None:
    """However long it is used, it keeps a few numbers only."""
    lag = LoopLag()
    for second in range(10_000):
        lag.record(float(second), 1.0 / (second + 1))
    assert kept_maxima(lag) == 7
    assert lag.longest_sec(10_000.0) == 1.0 / 9941
