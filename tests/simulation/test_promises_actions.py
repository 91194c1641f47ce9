"""Promises about actions while things break: nothing hangs, and each live client gets one terminal state."""

from __future__ import annotations

import asyncio
from collections import Counter
from typing import Any

import pytest

import actors
from actors import CancelResponse, GoalState
from actors.interfaces.example_interfaces.action import Fibonacci
from tests.simulation.network import BROKER
from tests.simulation.stage import Stage, play

SOON_SEC = 0.1
"""What a few messages take over the stage's network, with much to spare."""

GOALS = 20


class Kitchen:
    """A server whose goals give feedback every 10 ms until they are told to end."""

    def __init__(self, node: actors.Node) -> None:
        self.leave = asyncio.Event()
        self.server = node.create_action_server(
            Fibonacci, "fibonacci", self.execute, cancel_callback=self.cancel
        )

    def cancel(self, goal: object) -> CancelResponse:
        return CancelResponse.ACCEPT

    async def execute(self, goal: actors.ServerGoalHandle[Any, Any, Any]) -> Fibonacci.Result:
        while not (self.leave.is_set() or goal.is_cancel_requested):
            goal.publish_feedback(Fibonacci.Feedback(sequence=[goal.request.order]))
            await asyncio.sleep(0.01)
        if goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.succeed()
        return Fibonacci.Result(sequence=[goal.request.order])


class Guest:
    """A client with goals in flight; it writes down how each of them has ended, for each that waits."""

    def __init__(self, node: actors.Node) -> None:
        self.client = node.create_action_client(Fibonacci, "fibonacci")
        self.handles: list[actors.ClientGoalHandle[Any, Any]] = []
        self.results: Counter[object] = Counter()
        self.iterations: Counter[object] = Counter()
        self.feedback = 0
        self.tasks: list[asyncio.Task[None]] = []

    async def order(self, goals: int = GOALS) -> None:
        """Send goals; a task awaits the result of each, and another iterates over its feedback."""
        assert await self.client.wait_for_server(5)
        for number in range(goals):
            handle = await self.client.send_goal(Fibonacci.Goal(order=number))
            self.handles.append(handle)
            self.tasks.append(asyncio.create_task(self._await(handle)))
            self.tasks.append(asyncio.create_task(self._iterate(handle)))

    def watch(self, handles: list[actors.ClientGoalHandle[Any, Any]]) -> None:
        """Wait for the results of another client's goals, too."""
        self.tasks += [asyncio.create_task(self._ask(handle)) for handle in handles]

    async def _ask(self, handle: actors.ClientGoalHandle[Any, Any]) -> None:
        try:
            self.results[(await self.client.get_result(handle.goal_id)).status] += 1
        except actors.CallFailed as error:
            self.results[type(error)] += 1

    async def _await(self, handle: actors.ClientGoalHandle[Any, Any]) -> None:
        try:
            self.results[(await handle.result()).status] += 1
        except actors.CallFailed as error:
            self.results[type(error)] += 1

    async def _iterate(self, handle: actors.ClientGoalHandle[Any, Any]) -> None:
        try:
            async for _ in handle:
                self.feedback += 1
            self.iterations["end"] += 1
        except actors.CallFailed as error:
            self.iterations[type(error)] += 1

    def ended(self) -> bool:
        """Whether every wait has ended, and nothing is left of the goals."""
        return all(task.done() for task in self.tasks) and not self.client.pending


async def kitchen_and_guest(stage: Stage) -> tuple[Kitchen, Guest]:
    """Bring up a server and a client with goals in flight, each on a host of its own."""
    kitchen = Kitchen(await stage.enter("server"))
    guest = Guest(await stage.enter("client"))
    await guest.order()
    await stage.until(lambda: guest.feedback >= GOALS)
    return kitchen, guest


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("victim", [BROKER, "server"])
def test_a_crash_ends_every_wait_once(victim: str, seed: int) -> None:
    """A killed broker or server: each result and each iteration ends at once, with ServiceUnavailable."""

    async def scene(stage: Stage) -> None:
        _, guest = await kitchen_and_guest(stage)
        if victim == BROKER:
            await stage.crash_broker()
        else:
            stage.network.crash(victim)
        await stage.until(guest.ended, SOON_SEC)
        assert guest.results == guest.iterations == {actors.ServiceUnavailable: GOALS}
        if victim == BROKER:
            await stage.start_broker()

    play(scene, seed)


def test_a_broken_link_of_the_server_ends_every_wait_and_no_goal() -> None:
    """Its goals go on; when the link is back, their results can be asked for by id, by any client."""

    async def scene(stage: Stage) -> None:
        kitchen, guest = await kitchen_and_guest(stage)
        stage.network.drop("server")
        await stage.until(guest.ended, SOON_SEC)
        assert guest.results == {actors.ServiceUnavailable: GOALS}
        assert await guest.client.wait_for_server(10)
        kitchen.leave.set()
        for number, handle in enumerate(guest.handles):
            result = await guest.client.get_result(handle.goal_id, 5)
            assert (result.status, list(result.result.sequence)) == (GoalState.SUCCEEDED, [number])

    play(scene)


def test_a_killed_client_does_not_disturb_the_others() -> None:
    """The server finishes its goals, and another client gets its own results, once each."""

    async def scene(stage: Stage) -> None:
        kitchen = Kitchen(await stage.enter("server"))
        guests = [Guest(await stage.enter(name)) for name in ("dies", "lives")]
        for guest in guests:
            await guest.order()
        stage.network.crash("dies")
        await asyncio.sleep(SOON_SEC)
        kitchen.leave.set()
        await stage.until(guests[1].ended, SOON_SEC)
        assert guests[1].results == {GoalState.SUCCEEDED: GOALS}
        assert guests[1].iterations == {"end": GOALS}
        await stage.until(lambda: not kitchen.server.active, SOON_SEC)

    play(scene)


@pytest.mark.parametrize("seed", range(5))
def test_cancellations_and_results_may_cross(seed: int) -> None:
    """Goals that end while they are being cancelled have one terminal state, the same for everybody."""

    async def scene(stage: Stage) -> None:
        kitchen, guest = await kitchen_and_guest(stage)
        answers = asyncio.gather(*(handle.cancel() for handle in guest.handles))
        await asyncio.sleep(seed * 0.0005)
        kitchen.leave.set()
        accepted = sum(bool(answer.goals_canceling) for answer in await answers)
        await stage.until(guest.ended, SOON_SEC)
        assert guest.results.total() == GOALS
        assert guest.results.keys() <= {GoalState.SUCCEEDED, GoalState.CANCELED}
        assert guest.results[GoalState.CANCELED] <= accepted
        assert guest.iterations == {"end": GOALS}
        late = Guest(await stage.enter("late"))
        assert await late.client.wait_for_server(5)
        for handle in guest.handles:
            assert await late.client.get_result(handle.goal_id, 5) == await handle.result()

    play(scene, seed)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("slow", [BROKER, "server", "watcher", "owner", None])
@pytest.mark.parametrize("cut", ["watcher", "owner", None])
def test_all_who_wait_for_a_goal_learn_its_end_once(cut: str | None, slow: str | None, seed: int) -> None:
    """Whoever has sent it, over slow links, too; a client whose link breaks is told, and may ask again."""

    async def scene(stage: Stage) -> None:
        kitchen = Kitchen(await stage.enter("server"))
        guests = {name: Guest(await stage.enter(name)) for name in ("owner", "watcher", "other")}
        await guests["owner"].order()
        for name in ("watcher", "other"):
            assert await guests[name].client.wait_for_server(5)
            guests[name].watch(guests["owner"].handles)
        await asyncio.sleep(SOON_SEC)
        if slow is not None:
            stage.network.slow_down(slow, read=4000, pause=0.02)
        if cut is not None:
            stage.network.drop(cut)
            await stage.until(guests[cut].ended, 5)
            assert guests[cut].results == {actors.ServiceUnavailable: GOALS}
            guests[cut].results.clear()
            assert await guests[cut].client.wait_for_server(20)
            guests[cut].watch(guests["owner"].handles)
            await asyncio.sleep(SOON_SEC)
        kitchen.leave.set()
        for guest in guests.values():
            await stage.until(guest.ended, 60)
            assert guest.results == {GoalState.SUCCEEDED: GOALS}

    play(scene, seed)
