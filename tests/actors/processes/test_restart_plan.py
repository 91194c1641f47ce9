"""The plan: what each strategy starts and stops, when, and when it gives up."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from actors.processes.child import Restart, Strategy
from actors.processes.restart_plan import (
    ChildState,
    GaveUp,
    Policy,
    RestartPlan,
    Start,
    Step,
    Stop,
    WillRestart,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

PERMANENT, TRANSIENT, TEMPORARY = Restart.PERMANENT, Restart.TRANSIENT, Restart.TEMPORARY
ALL = (Strategy.ONE_FOR_ONE, Strategy.ONE_FOR_ALL, Strategy.REST_FOR_ONE)


def plan_of(
    strategy: Strategy, *restarts: Restart, max_restarts: int = 3, jitter: float = 1.0
) -> RestartPlan:
    """Return a plan for these children, without chance in it."""
    policy = Policy(strategy=strategy, max_restarts=max_restarts)
    return RestartPlan(restarts or (PERMANENT,) * 3, policy, lambda: jitter)


def bring_up(plan: RestartPlan, count: int = 3, now: float = 0.0) -> None:
    """Start all children of a plan."""
    steps = plan.begin(now)
    for child in range(count):
        assert steps == [Start(child)]
        steps = plan.started(child, now)
    assert steps == []


@pytest.mark.parametrize("strategy", ALL)
def test_children_start_one_after_the_other(strategy: Strategy) -> None:
    """The next one starts when the one before it runs."""
    plan = plan_of(strategy)
    bring_up(plan)
    assert [plan.state(child) for child in range(3)] == [ChildState.RUNNING] * 3


@pytest.mark.parametrize("strategy", ALL)
def test_stopping_goes_backwards_one_at_a_time(strategy: Strategy) -> None:
    """The last one started is stopped first, and the next when it has gone."""
    plan = plan_of(strategy)
    bring_up(plan)
    assert plan.stop(1) == [Stop(2)]
    assert plan.stop(1) == []
    assert plan.ended(2, 1, normal=True) == [Stop(1)]
    assert plan.ended(1, 1, normal=False) == [Stop(0)]
    assert not plan.finished
    assert plan.ended(0, 1, normal=True) == []
    assert plan.finished


def test_a_forced_stop_stops_all_that_are_left() -> None:
    """Those that are not being stopped yet are stopped at once."""
    plan = plan_of(Strategy.ONE_FOR_ONE)
    bring_up(plan)
    assert plan.stop(1) == [Stop(2)]
    assert plan.force_stop() == [Stop(0), Stop(1)]


def test_one_for_one_restarts_the_dead_one_only() -> None:
    """The others run on; the dead one starts when its back-off is over."""
    plan = plan_of(Strategy.ONE_FOR_ONE)
    bring_up(plan)
    assert plan.ended(1, 1.0, normal=False) == [WillRestart(1, 0.1)]
    assert plan.wake_at == pytest.approx(1.1)
    assert plan.tick(1.05) == []
    assert plan.tick(1.1) == [Start(1)]
    assert plan.state(0) is plan.state(2) is ChildState.RUNNING
    assert plan.restarts(1) == 1


def test_one_for_one_restarts_do_not_wait_for_each_other() -> None:
    """A child that takes long to start holds up no other's restart."""
    plan = plan_of(Strategy.ONE_FOR_ONE)
    bring_up(plan)
    plan.ended(0, 1, normal=False)
    assert plan.tick(2) == [Start(0)]
    plan.ended(1, 2, normal=False)
    assert plan.tick(3) == [Start(1)]


def test_one_for_all_stops_backwards_and_starts_forwards() -> None:
    """All the others go, last first; then all come, first first."""
    plan = plan_of(Strategy.ONE_FOR_ALL)
    bring_up(plan)
    assert plan.ended(1, 1, normal=False) == [WillRestart(1, 0.1), Stop(2)]
    assert plan.ended(2, 1, normal=True) == [Stop(0)]
    assert plan.tick(2) == []
    assert plan.ended(0, 3, normal=True) == [Start(0)]
    assert plan.started(0, 3) == [Start(1)]
    assert plan.started(1, 3) == [Start(2)]


def test_rest_for_one_leaves_those_before_alone() -> None:
    """Only who stands behind the dead one is stopped and started with it."""
    plan = plan_of(Strategy.REST_FOR_ONE)
    bring_up(plan)
    assert plan.ended(1, 1, normal=False) == [WillRestart(1, 0.1), Stop(2)]
    assert plan.ended(2, 1, normal=True) == []
    assert plan.tick(2) == [Start(1)]
    assert plan.started(1, 2) == [Start(2)]
    assert plan.restarts(0) == 0


def test_a_death_while_it_is_to_be_stopped_anyway_counts_once() -> None:
    """Two of three die at the same moment: one restart of the group, one count."""
    plan = plan_of(Strategy.ONE_FOR_ALL, max_restarts=1)
    bring_up(plan)
    assert plan.ended(0, 1, normal=False) == [WillRestart(0, 0.1), Stop(2)]
    assert plan.ended(1, 1, normal=False) == []
    assert plan.ended(2, 1, normal=True) == []
    assert plan.tick(2) == [Start(0)]
    assert plan.started(0, 2) == [Start(1)]
    assert plan.started(1, 2) == [Start(2)]


def test_a_death_in_the_middle_of_a_restart_begins_it_anew() -> None:
    """The group is half up and its first child dies: what is up goes, and all comes again."""
    plan = plan_of(Strategy.ONE_FOR_ALL)
    bring_up(plan)
    plan.ended(2, 1, normal=False)
    plan.ended(1, 1, normal=True)
    plan.ended(0, 1, normal=True)
    assert plan.tick(2) == [Start(0)]
    assert plan.started(0, 2) == [Start(1)]
    assert plan.ended(0, 2, normal=False) == [WillRestart(0, 0.1), Stop(1)]
    assert plan.ended(1, 2, normal=True) == []
    assert plan.tick(3) == [Start(0)]


def test_a_death_before_the_group_that_restarts_joins_it() -> None:
    """REST_FOR_ONE: while the second's restart is under way the first dies, so that all three start."""
    plan = plan_of(Strategy.REST_FOR_ONE)
    bring_up(plan)
    assert plan.ended(1, 1, normal=False) == [WillRestart(1, 0.1), Stop(2)]
    assert plan.ended(0, 1, normal=False) == [WillRestart(0, 0.1)]
    assert plan.ended(2, 1, normal=True) == []
    assert plan.tick(2) == [Start(0)]
    assert plan.started(0, 2) == [Start(1)]
    assert plan.started(1, 2) == [Start(2)]


@pytest.mark.parametrize(
    ("restart", "normal", "comes_back"),
    [
        (PERMANENT, True, True),
        (PERMANENT, False, True),
        (TRANSIENT, True, False),
        (TRANSIENT, False, True),
        (TEMPORARY, True, False),
        (TEMPORARY, False, False),
    ],
)
def test_which_ends_are_deaths(restart: Restart, *, normal: bool, comes_back: bool) -> None:
    """PERMANENT: every end; TRANSIENT: an abnormal one; TEMPORARY: none."""
    plan = plan_of(Strategy.ONE_FOR_ALL, restart)
    bring_up(plan, 1)
    steps = plan.ended(0, 1, normal=normal)
    assert bool(steps) is comes_back
    assert plan.finished is not comes_back


def test_a_temporary_child_is_not_brought_back_with_the_group() -> None:
    """It is stopped for another's sake, and that is its end; a transient one that had ended comes again."""
    plan = plan_of(Strategy.ONE_FOR_ALL, PERMANENT, TEMPORARY, TRANSIENT)
    bring_up(plan)
    assert plan.ended(2, 1, normal=True) == []
    assert plan.ended(0, 1, normal=False) == [WillRestart(0, 0.1), Stop(1)]
    plan.ended(1, 1, normal=True)
    assert plan.tick(2) == [Start(0)]
    assert plan.started(0, 2) == [Start(2)]
    assert plan.state(1) is ChildState.ENDED


def test_one_death_too_many_ends_it() -> None:
    """With the fourth death within the window the others are stopped, and nothing is started again."""
    plan = plan_of(Strategy.ONE_FOR_ONE, PERMANENT, PERMANENT)
    bring_up(plan, 2)
    now = 1.0
    for _ in range(3):
        plan.ended(1, now, normal=False)
        now += 1.0
        assert plan.tick(now) == [Start(1)]
    assert plan.ended(1, now, normal=False) == [GaveUp(1), Stop(0)]
    assert plan.ended(0, now, normal=True) == []
    assert plan.finished


def test_deaths_that_are_far_apart_do_not_add_up() -> None:
    """Only those within the window count."""
    plan = plan_of(Strategy.ONE_FOR_ONE, PERMANENT, max_restarts=1)
    bring_up(plan, 1)
    for death in range(1, 20):
        assert plan.ended(0, 6.0 * death, normal=False) == [WillRestart(0, plan_delay(death))]
        assert plan.tick(6.0 * death + 5.0) == [Start(0)]


def plan_delay(death: int) -> float:
    """Return the back-off of the n-th death in a row."""
    return min(0.1 * 2.0 ** (death - 1), 5.0)


def test_the_back_off_begins_anew_after_a_long_life() -> None:
    """A child that has lived twice the longest back-off is well again."""
    plan = plan_of(Strategy.ONE_FOR_ONE, PERMANENT, max_restarts=100)
    bring_up(plan, 1)
    assert plan.ended(0, 1, normal=False) == [WillRestart(0, 0.1)]
    assert plan.tick(2) == [Start(0)]
    assert plan.ended(0, 11.9, normal=False) == [WillRestart(0, 0.2)]
    assert plan.tick(20) == [Start(0)]
    assert plan.ended(0, 30.0, normal=False) == [WillRestart(0, 0.1)]


def test_jitter_takes_off_up_to_half() -> None:
    """The least back-off is half of its length."""
    plan = plan_of(Strategy.ONE_FOR_ONE, PERMANENT, jitter=0.0)
    bring_up(plan, 1)
    assert plan.ended(0, 1, normal=False) == [WillRestart(0, 0.05)]


def test_zero_restarts_means_the_first_death_is_one_too_many() -> None:
    """max_restarts=0: no child is ever restarted."""
    plan = plan_of(Strategy.ONE_FOR_ONE, PERMANENT, max_restarts=0)
    bring_up(plan, 1)
    assert plan.ended(0, 1, normal=False) == [GaveUp(0)]
    assert plan.finished


@pytest.mark.parametrize(
    "wrong",
    [
        {"max_restarts": -1},
        {"restart_window_sec": 0.0},
        {"first_backoff_sec": -0.1},
        {"first_backoff_sec": 6.0},
        {"restart_window_sec": float("nan")},
    ],
)
def test_numbers_out_of_range_are_refused(wrong: dict[str, float]) -> None:
    """A policy that makes no sense is a ValueError."""
    with pytest.raises(ValueError, match="must be"):
        Policy(**wrong)  # type: ignore[arg-type]


@given(st.integers(0, 2000), st.floats(0, 10), st.floats(0, 100))
def test_back_offs_stay_within_their_limits(deaths: int, first: float, longest: float) -> None:
    """However often a child dies, its back-off neither overflows nor passes the longest."""
    policy = Policy(max_restarts=10_000, first_backoff_sec=min(first, longest), max_backoff_sec=longest)
    plan = RestartPlan([PERMANENT], policy, lambda: 1.0)
    plan.begin(0)
    for _ in range(min(deaths, 70)):
        (step,) = plan.ended(0, 0, normal=False)[:1]
        assert isinstance(step, WillRestart)
        assert 0 <= step.delay_sec <= longest
        plan.tick(longest)
        plan.tick(2 * longest)


class Anything(RuleBasedStateMachine):
    """Children that end whenever they like, and a supervisor that does what the plan says, at any pace."""

    @initialize(
        strategy=st.sampled_from(ALL),
        restarts=st.lists(st.sampled_from((PERMANENT, TRANSIENT, TEMPORARY)), max_size=5),
        max_restarts=st.integers(0, 6),
    )
    def setup(self, strategy: Strategy, restarts: Sequence[Restart], max_restarts: int) -> None:
        self.now = 0.0
        self.restarts = restarts
        self.policy = Policy(strategy=strategy, max_restarts=max_restarts)
        self.plan = RestartPlan(restarts, self.policy, lambda: 0.5)
        self.starting: set[int] = set()
        self.running: set[int] = set()
        self.told: set[int] = set()
        self.forced = False
        self.stopped = False
        self.gave_up = 0
        self.take(self.plan.begin(0.0))

    @property
    def alive(self) -> set[int]:
        return self.starting | self.running

    def take(self, steps: list[Step]) -> None:
        for step in steps:
            match step:
                case Start(child):
                    assert child not in self.alive
                    assert not self.told, "nothing starts while something must go"
                    assert not self.stopped
                    assert not self.gave_up
                    if self.policy.strategy is not Strategy.ONE_FOR_ONE:
                        assert not self.starting, "one after the other"
                    self.starting.add(child)
                case Stop(child):
                    assert child in self.alive
                    assert child not in self.told
                    if not self.forced:
                        assert not self.told, "one after the other"
                        if self.policy.strategy is not Strategy.REST_FOR_ONE or self.stopped or self.gave_up:
                            assert child == max(self.alive), "the last one first"
                    self.told.add(child)
                case WillRestart(child, delay):
                    assert self.restarts[child] is not TEMPORARY
                    assert 0 < delay <= self.policy.max_backoff_sec
                case GaveUp():
                    self.gave_up += 1
        assert self.gave_up <= 1

    @precondition(lambda self: self.starting)
    @rule(data=st.data())
    def one_starts(self, data: st.DataObject) -> None:
        child = data.draw(st.sampled_from(sorted(self.starting)))
        self.starting.discard(child)
        self.running.add(child)
        self.take(self.plan.started(child, self.now))

    @precondition(lambda self: self.alive)
    @rule(data=st.data(), normal=st.booleans())
    def one_ends(self, data: st.DataObject, *, normal: bool) -> None:
        child = data.draw(st.sampled_from(sorted(self.alive)))
        self.starting.discard(child)
        self.running.discard(child)
        self.told.discard(child)
        self.take(self.plan.ended(child, self.now, normal=normal))

    @rule(seconds=st.sampled_from((0.0, 0.05, 1.0, 30.0)))
    def time_passes(self, seconds: float) -> None:
        self.now += seconds
        self.take(self.plan.tick(self.now))

    @precondition(lambda self: not self.stopped)
    @rule(force=st.booleans())
    def stop(self, *, force: bool) -> None:
        self.stopped = True
        self.take(self.plan.stop(self.now))
        if force:
            self.forced = True
            self.take(self.plan.force_stop())

    @invariant()
    def states_are_true(self) -> None:
        for child in range(len(self.restarts)):
            state = self.plan.state(child)
            if child in self.told:
                assert state is ChildState.STOPPING
            elif child in self.starting:
                assert state is ChildState.STARTING
            elif child in self.running:
                assert state is ChildState.RUNNING
            else:
                assert state in (ChildState.WAITING, ChildState.ENDED)
            if state is ChildState.WAITING:
                assert self.alive or self.plan.wake_at is not None, "it would wait for ever"
        assert not (self.plan.finished and self.alive)
        if self.stopped or self.gave_up:
            assert self.plan.finished or self.told

    def teardown(self) -> None:
        """Whatever was before: if now everybody obeys, all that is to run runs, or all have ended."""
        if not hasattr(self, "plan"):
            return
        for _ in range(1000):
            if self.told:
                child = min(self.told)
                for group in (self.told, self.starting, self.running):
                    group.discard(child)
                self.take(self.plan.ended(child, self.now, normal=True))
            elif self.starting:
                child = min(self.starting)
                self.starting.discard(child)
                self.running.add(child)
                self.take(self.plan.started(child, self.now))
            else:
                due = self.plan.wake_at
                if due is None:
                    break
                self.now = due
                self.take(self.plan.tick(due))
        else:
            pytest.fail("it never comes to rest")
        calm = {ChildState.RUNNING, ChildState.ENDED}
        assert all(self.plan.state(child) in calm for child in range(len(self.restarts)))


TestAnything = Anything.TestCase
