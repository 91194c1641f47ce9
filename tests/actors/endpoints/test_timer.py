"""Timers, on a virtual clock: an hour takes no time and is exact."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import TYPE_CHECKING, Any

import pytest

import actors
from tests.simulation.loop import simulate

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from tests.simulation.loop import SimulatedLoop

    Scene = Callable[[actors.Node, SimulatedLoop], Awaitable[None]]


def play(scene: Scene) -> None:
    """Run a scene with a node that has no broker, on a virtual clock."""

    async def main(loop: SimulatedLoop) -> None:
        async with actors.Node("clockwork", use_global_arguments=False) as node:
            await scene(node, loop)
        await asyncio.sleep(10)
        assert asyncio.all_tasks() == {asyncio.current_task()}

    simulate(main)


def test_ticks_come_at_whole_periods() -> None:
    """Nothing before half a period, exactly four in four and a half; no drift in an hour."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        times: list[float] = []
        start = loop.time()
        timer = node.create_timer(0.1, lambda: times.append(loop.time() - start))
        await asyncio.sleep(0.05)
        assert times == []
        await asyncio.sleep(0.4)
        assert times == pytest.approx([0.1, 0.2, 0.3, 0.4])
        await asyncio.sleep(3600 - 0.45 + 0.05)
        assert timer.ticks == 36_000
        assert times[-1] == pytest.approx(3600)
        assert timer.skipped == 0

    play(scene)


def test_cancel_stops_and_reset_restarts() -> None:
    """After cancel no tick and no next call; reset starts a whole period from then."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        ticks: list[float] = []
        timer = node.create_timer(1, lambda: ticks.append(loop.time()))
        await asyncio.sleep(2.5)
        assert len(ticks) == 2
        assert timer.time_until_next_call() == pytest.approx(0.5e9)
        timer.cancel()
        assert timer.is_canceled()
        assert timer.time_until_next_call() is None
        await asyncio.sleep(5)
        assert len(ticks) == 2
        timer.reset()
        assert not timer.is_canceled()
        assert timer.time_until_next_call() == pytest.approx(1e9)
        await asyncio.sleep(2.5)
        assert len(ticks) == 4
        timer.reset()
        await asyncio.sleep(0.7)
        assert len(ticks) == 4

    play(scene)


def test_autostart_can_wait() -> None:
    """With autostart=False a timer is cancelled until reset."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        ticks: list[float] = []
        timer = node.create_timer(1, lambda: ticks.append(loop.time()), autostart=False)
        await asyncio.sleep(3)
        assert timer.is_canceled()
        assert ticks == []
        timer.reset()
        await asyncio.sleep(1.5)
        assert len(ticks) == 1

    play(scene)


def test_a_callback_may_take_the_times() -> None:
    """One parameter gets expected and actual call time; two are refused."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        infos: list[Any] = []
        node.create_timer(1, infos.append)
        await asyncio.sleep(0.5)
        loop.stall(0.75)
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        (info,) = infos
        assert info.actual_call_time - info.expected_call_time == pytest.approx(0.25e9)
        with pytest.raises(RuntimeError, match="takes 0 or 1 arguments"):
            node.create_timer(1, lambda a, b: None)

    play(scene)


def test_a_zero_period_ticks_at_once_and_starves_nobody() -> None:
    """Period zero fires in every turn of the loop, beside others."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        timer = node.create_timer(0, lambda: None)
        for _ in range(10):
            await asyncio.sleep(0)
        assert 3 <= timer.ticks <= 10
        timer.cancel()
        before = timer.ticks
        for _ in range(10):
            await asyncio.sleep(0)
        assert timer.ticks == before

    play(scene)


def test_a_very_late_tick_knows_when_it_was_due() -> None:
    """After a stall of many periods, and behind a busy mailbox: its own time, not a later one."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        late: list[int] = []

        def note(info: actors.TimerInfo) -> None:
            late.append(info.actual_call_time - info.expected_call_time)

        async def block() -> None:
            blocker.cancel()
            await asyncio.sleep(4.5)

        timer = node.create_timer(1, note)
        await asyncio.sleep(0.5)
        loop.stall(5.2)
        await asyncio.sleep(0.1)
        assert late == pytest.approx([4.7e9])
        timer.reset()
        blocker = node.create_timer(0.5, block)
        await asyncio.sleep(5.2)
        assert late[1:2] == pytest.approx([4.0e9])

    play(scene)


def test_a_zero_period_does_not_make_the_loop_spin_while_its_callback_runs() -> None:
    """The next tick is armed when the callback has ended: a slow one costs no turns of the loop."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        async def slow() -> None:
            await asyncio.sleep(1)

        before = loop.turns
        timer = node.create_timer(0, slow)
        await asyncio.sleep(9.5)
        assert timer.ticks == 10
        assert timer.skipped == 0
        assert loop.turns - before < 500

    play(scene)


@pytest.mark.parametrize("period", [-1, float("inf"), float("nan")])
def test_a_bad_period_is_refused(period: float) -> None:
    """A period is zero or more seconds."""
    node = actors.Node("clockwork", use_global_arguments=False)
    with pytest.raises(ValueError, match="period"):
        node.create_timer(period, lambda: None)


def test_both_kinds_of_callbacks_are_taken() -> None:
    """`async def` ticks, too; a tick that passes while one runs is skipped and counted."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        times: list[float] = []
        began = loop.time()

        async def slow() -> None:
            times.append(loop.time() - began)
            await asyncio.sleep(2.5)

        timer = node.create_timer(1, slow)
        await asyncio.sleep(7.1)
        assert times == pytest.approx([1, 4, 7])
        assert (timer.ticks, timer.skipped) == (3, 4)

    play(scene)


def test_a_stalled_loop_skips_ticks_and_keeps_the_beat() -> None:
    """After a stall one tick comes late, the others are skipped, and the next is on the beat."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        times: list[float] = []
        began = loop.time()
        timer = node.create_timer(1, lambda: times.append(loop.time() - began))
        await asyncio.sleep(0.5)
        loop.stall(5.2)
        await asyncio.sleep(1)
        assert times == pytest.approx([5.7, 6])
        assert (timer.ticks, timer.skipped) == (2, 4)

    play(scene)


def test_a_raising_callback_ticks_on() -> None:
    """Errors are counted, the timer goes on, in both kinds of callbacks."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        def plain() -> None:
            raise ValueError("bad luck")

        async def slow() -> None:
            raise asyncio.CancelledError

        first, second = node.create_timer(1, plain), node.create_timer(1, slow)
        await asyncio.sleep(3.5)
        assert (first.ticks, second.ticks) == (3, 3)
        assert node.callback_errors == 6

    play(scene)


def test_a_destroyed_timer_is_over() -> None:
    """Destroying stops it, cancels the callback that runs, twice is no error; reset is refused."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        ends: list[str] = []

        async def endless() -> None:
            try:
                await asyncio.sleep(1000)
            except asyncio.CancelledError:
                ends.append("cancelled")
                raise

        timer = node.create_timer(1, endless)
        await asyncio.sleep(1.5)
        assert node.destroy_timer(timer)
        assert not node.destroy_timer(timer)
        timer.destroy()
        await asyncio.sleep(3)
        assert ends == ["cancelled"]
        assert node.callback_errors == 0
        with pytest.raises(RuntimeError, match="destroyed"):
            timer.reset()

    play(scene)


def test_a_callback_may_cancel_and_destroy_its_own_timer() -> None:
    """A timer may end itself from its callback, plain or not."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        seen: list[str] = []

        def once() -> None:
            seen.append("plain")
            plain.cancel()

        async def last() -> None:
            node.destroy_timer(slow)
            seen.append("slow")

        plain, slow = node.create_timer(1, once), node.create_timer(1, last)
        await asyncio.sleep(5)
        assert seen == ["plain", "slow"]

    play(scene)


def test_timers_made_before_the_node_runs_start_with_it() -> None:
    """A timer of a node that does not run yet starts its first period on entry."""

    async def main(loop: SimulatedLoop) -> None:
        times: list[float] = []
        node = actors.Node("clockwork", use_global_arguments=False)
        timer = node.create_timer(1, lambda: times.append(loop.time()))
        assert timer.time_until_next_call() is None
        await asyncio.sleep(10)
        async with node:
            await asyncio.sleep(2.5)
        await asyncio.sleep(10)
        assert times == pytest.approx([11, 12])

    simulate(main)


def test_sleeps_of_the_clock_run_side_by_side() -> None:
    """Three sleeps end in time and none early; zero and less return at once."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        ends: list[float] = []

        async def one(seconds: float) -> None:
            await node.get_clock().sleep(seconds)
            ends.append(loop.time())

        start = loop.time()
        await asyncio.gather(*map(one, [0.2, 0.05, 0.1, 0, -1]))
        assert [end - start for end in ends] == pytest.approx([0, 0, 0.05, 0.1, 0.2])

    play(scene)


def test_a_sleep_ends_with_its_node() -> None:
    """A task that sleeps on a destroyed node's clock gets NodeDestroyed, also if it sleeps again."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        sleeper = asyncio.ensure_future(node.get_clock().sleep(100))
        await asyncio.sleep(1)
        node.destroy_node()
        await asyncio.wait([sleeper], timeout=1)
        assert isinstance(sleeper.exception(), actors.NodeDestroyed)
        with pytest.raises(actors.NodeDestroyed):
            await node.get_clock().sleep(1)

    play(scene)


def test_ticks_take_turns_with_other_callbacks() -> None:
    """The mailbox is the node's: a tick waits until another timer's callback has ended."""

    async def scene(node: actors.Node, loop: SimulatedLoop) -> None:
        inside: set[str] = set()
        seen: list[str] = []

        async def alone(name: str) -> None:
            assert not inside
            inside.add(name)
            await asyncio.sleep(0.3)
            inside.remove(name)
            seen.append(name)

        for name in ("a", "b", "c"):
            node.create_timer(1, partial(alone, name))
        await asyncio.sleep(1.95)
        assert sorted(seen) == ["a", "b", "c"]
        assert node.callback_errors == 0

    play(scene)


def test_swapped_arguments_are_named() -> None:
    """The error says the order."""
    node = actors.Node("clockwork", use_global_arguments=False)
    with pytest.raises(TypeError, match=r"period in seconds first.*create_timer\(0\.5, callback\)"):
        node.create_timer(print, 0.5)  # type: ignore[arg-type] # pyright: ignore[reportArgumentType]
