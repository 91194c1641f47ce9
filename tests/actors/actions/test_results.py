"""Kept results: for how long, and how many."""

from __future__ import annotations

import math

import pytest

from actors.actions.results import KeptResults
from actors.interfaces.action_msgs.msg import GoalInfo


def test_results_expire_in_order() -> None:
    """Each result is kept for the timeout, and no longer."""
    results = KeptResults(10.0)
    for number in range(3):
        results.add(bytes([number]), GoalInfo(), number, size=1, now=float(number))
    assert results.next_expiry == 10.0
    results.expire(11.0)
    assert [each.response for each in results] == [2]
    assert results.get(bytes([0])) is None
    assert results.dropped == 0


def test_a_negative_timeout_keeps_results() -> None:
    """As in ROS, results then never expire."""
    results = KeptResults(-1.0)
    results.add(b"a", GoalInfo(), 1, size=1, now=0.0)
    results.expire(1e12)
    assert (len(results), results.next_expiry) == (1, math.inf)


@pytest.mark.parametrize("limit", [{"max_results": 2}, {"max_bytes": 25}])
def test_the_oldest_results_are_dropped_at_a_limit(limit: dict[str, int]) -> None:
    """Both limits drop the oldest, counted; the newest stays even if it alone is too large."""
    results = KeptResults(10.0, **limit)
    for number in range(4):
        results.add(bytes([number]), GoalInfo(), number, size=10, now=0.0)
    assert [each.response for each in results] == [2, 3]
    assert results.dropped == 2
    results.add(b"large", GoalInfo(), "large", size=100, now=0.0)
    assert "large" in [each.response for each in results]
