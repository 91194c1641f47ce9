"""How often a bridge reads graphs and plans, with a simulated clock."""

from __future__ import annotations

from random import Random

import pytest

from actors.bridges.planning_budget import MOST_PAUSE_SEC, SHARE, PlanningBudget


@pytest.mark.parametrize("cost_sec", [0.001, 0.02, 0.06])
def test_work_for_a_graph_that_changes_all_the_time_is_a_share_of_the_time(cost_sec: float) -> None:
    """Whatever a plan costs; reading the graph and planning share the budget."""
    budget, random, now, worked = PlanningBudget(), Random(7), 0.0, 0.0
    while now < 60:
        for _ in range(2):
            cost = cost_sec * random.uniform(0.5, 1.5)
            now, worked = now + cost, worked + cost
            budget.spend(now, cost)
        now += budget.pause(now)
    assert worked / now == pytest.approx(SHARE, rel=0.01)


def test_a_change_after_a_quiet_time_is_planned_at_once() -> None:
    """What is not spent is not saved, either: a burst of changes gets no more than its share."""
    budget = PlanningBudget()
    assert not budget.pause(10)
    budget.spend(10.15, 0.15)
    assert budget.pause(10.15) == pytest.approx(0.6)
    assert not budget.pause(10.8)
    budget.spend(100.15, 0.15)
    assert budget.pause(100.15) == pytest.approx(0.6)


def test_no_pause_is_longer_than_the_limit() -> None:
    """Also if work has cost a minute: the graphs are read again soon."""
    budget = PlanningBudget()
    budget.spend(100, 60)
    budget.spend(100, 60)
    assert budget.pause(100) == MOST_PAUSE_SEC
