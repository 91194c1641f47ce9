"""An action server, and a sender that keeps some goals in flight and takes their feedback."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Any, Final

import actors
from actors.cli.bench.roles import percentiles_us
from actors.interfaces.example_interfaces.action import Fibonacci
from benchmarks.harness.roles.parent import Load
from benchmarks.harness.roles.requests import WAIT_S

if TYPE_CHECKING:
    from collections.abc import Mapping

    from benchmarks.harness.roles.parent import Parent

ACTION: Final = "bench_fibonacci"
WARM_UP_GOALS: Final = 100
FEEDBACK: Final = Fibonacci.Feedback(sequence=[0, 1, 1, 2, 3, 5, 8, 13])
PER_TURN: Final = 10
"""Feedback messages published in one loop turn: the depth of ROS's profile."""


async def action_server(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Execute goals until the parent lets go; the goal's order is the number of its feedback messages."""
    handled = 0

    async def execute(goal: actors.ServerGoalHandle[Any, Any, Any]) -> Fibonacci.Result:
        nonlocal handled
        handled += goal.request.order or 1
        for number in range(goal.request.order):
            goal.publish_feedback(FEEDBACK)
            if number % PER_TURN == PER_TURN - 1:
                await asyncio.sleep(0)
        goal.succeed()
        return Fibonacci.Result(sequence=[goal.request.order])

    async with actors.Node("bench_action_server", url=parameters["url"]) as node:
        node.create_action_server(Fibonacci, ACTION, execute)
        await node.get_graph()  # behind our declarations: the action is there
        await parent.ready()
        load = Load()
        await parent.gone()
        return load.figures(handled)


async def goal_sender(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Keep `in_flight` goals in flight for `seconds`; count their feedback."""
    times_s: list[float] = []
    goals = received = 0
    order = parameters.get("feedback", 0)

    def on_feedback(message: object) -> None:
        nonlocal received
        del message
        received += 1

    async with actors.Node("bench_goal_sender", url=parameters["url"]) as node:
        client = node.create_action_client(Fibonacci, ACTION)

        async def pursue() -> None:
            handle = await client.send_goal(Fibonacci.Goal(order=order), on_feedback)
            status, result = await handle.result()
            if status is not actors.GoalState.SUCCEEDED or list(result.sequence) != [order]:
                raise RuntimeError(f"a goal has ended as {status.name}")

        async def pursue_goals(stop: float) -> None:
            nonlocal goals
            while (began := time.perf_counter()) < stop:
                goals += 1
                await pursue()
                times_s.append(time.perf_counter() - began)

        await parent.ready()
        if not await client.wait_for_server(WAIT_S):
            raise RuntimeError(f"nobody serves {client.action_name}")
        for _ in range(1 if order else WARM_UP_GOALS):
            await pursue()
        received = 0
        load = Load()
        stop = time.perf_counter() + parameters["seconds"]
        async with asyncio.TaskGroup() as group:
            for _ in range(parameters["in_flight"]):
                group.create_task(pursue_goals(stop))
        elapsed_s = load.elapsed_s
        handled = received if order else goals
        return load.figures(handled, rate=handled / elapsed_s, **percentiles_us(times_s))
