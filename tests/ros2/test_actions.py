"""Actions cross in both directions."""

from __future__ import annotations

import asyncio
import sys
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors import CancelResponse, GoalResponse, GoalState
from tests.ros2.graphs import endpoints_until
from tests.ros2.ros import interface

if TYPE_CHECKING:
    from tests.ros2.conftest import Pair

FIBONACCI: Any = interface("test_msgs/action/Fibonacci")
GOAL: Any = FIBONACCI.Goal(order=3)
FEEDBACK: list[Any] = [FIBONACCI.Feedback(sequence=[number]) for number in range(3)]
RESULT: Any = FIBONACCI.Result(sequence=[1, 2, 3])
SUCCEEDED, CANCELED, ABORTED = (
    int(each) for each in (GoalState.SUCCEEDED, GoalState.CANCELED, GoalState.ABORTED)
)
SERVE = """
import asyncio, sys
import actors
from tests.ros2.test_actions import Server

async def serve():
    async with actors.Node("server", url=sys.argv[1], shared_name=True) as node:
        Server(node, sys.argv[2])
        await asyncio.Event().wait()

asyncio.run(serve())
"""
"""A process with an action server of a name, at the broker of a URL."""


class Server:
    """An action server of callboard that holds its goals until the test ends them.

    Attributes:
        goals: The goals that it executes.
        ending: Set when they shall end.
        cancelled: Set when somebody wants them to end.
    """

    def __init__(self, node: actors.Node, name: str) -> None:
        self.goals: list[Any] = []
        self.ending: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        self.cancelled = asyncio.Event()
        self.response = GoalResponse.ACCEPT
        self.server: Any = node.create_action_server(
            FIBONACCI,
            name,
            self._execute,
            goal_callback=lambda _: self.response,
            cancel_callback=self._cancel,
        )

    async def _execute(self, goal: Any) -> Any:
        self.goals.append(goal)
        for each in FEEDBACK:
            goal.publish_feedback(each)
        getattr(goal, await asyncio.shield(self.ending))()
        return RESULT

    def _cancel(self, _: object) -> CancelResponse:
        self.cancelled.set()
        return CancelResponse.ACCEPT


async def test_a_goal_of_callboard_succeeds_in_ros(pair: Pair) -> None:
    """It is accepted, and feedback and result arrive as they were."""
    name = f"{pair.name}/there"
    server = await pair.there.action_server(name, FIBONACCI, RESULT, FEEDBACK, ending="later")
    client: Any = pair.here.create_action_client(FIBONACCI, name)
    assert await client.wait_for_server()
    # Feedback is lost where nobody has subscribed yet, as between nodes of ROS.
    await pair.there.endpoints(f"{name}/_action/feedback", "subscriptions", 1)
    goal = await client.send_goal(GOAL)
    assert goal.accepted
    assert await server.goals(1) == [GOAL]
    await server.end_goals("succeed")
    result = await goal.result()
    assert (result.status, result.result) == (GoalState.SUCCEEDED, RESULT)
    assert [each async for each in goal] == FEEDBACK


async def test_a_goal_of_ros_succeeds_in_callboard(pair: Pair) -> None:
    """It is accepted, and feedback and result arrive as they were."""
    name = f"{pair.name}/here"
    server = Server(pair.here, name)
    client = await pair.there.action_client(name, FIBONACCI)
    await endpoints_until(pair.here, "subscriptions", f"{name}/_action/feedback", 1)
    goal = await client.send(GOAL)
    state = await goal.state("accepted", feedback=len(FEEDBACK))
    assert state["accepted"]
    assert state["feedback"] == FEEDBACK
    assert [each.request for each in server.goals] == [GOAL]
    server.ending.set_result("succeed")
    state = await goal.state("result")
    assert (state["status"], state["result"]) == (SUCCEEDED, RESULT)


@pytest.mark.parametrize("ending", ["abort", "reject"])
async def test_ros_aborts_or_rejects_a_goal_of_callboard(ending: str, pair: Pair) -> None:
    """The client knows it as of a server here."""
    name = f"{pair.name}/no_there"
    await pair.there.action_server(name, FIBONACCI, RESULT, ending=ending)
    client: Any = pair.here.create_action_client(FIBONACCI, name)
    assert await client.wait_for_server()
    if ending == "reject":
        with pytest.raises(actors.GoalRejected):
            await (await client.send_goal(GOAL)).result()
        return
    result = await (await client.send_goal(GOAL)).result()
    assert (result.status, result.result) == (GoalState.ABORTED, RESULT)


@pytest.mark.parametrize("ending", ["abort", "reject"])
async def test_callboard_aborts_or_rejects_a_goal_of_ros(ending: str, pair: Pair) -> None:
    """The client knows it as of a server there."""
    name = f"{pair.name}/no_here"
    server = Server(pair.here, name)
    server.response = GoalResponse.REJECT if ending == "reject" else GoalResponse.ACCEPT
    server.ending.set_result(ending)
    goal = await (await pair.there.action_client(name, FIBONACCI)).send(GOAL)
    if ending == "reject":
        assert not (await goal.state("accepted"))["accepted"]
        return
    state = await goal.state("result")
    assert (state["status"], state["result"]) == (ABORTED, RESULT)


async def test_a_goal_in_ros_is_cancelled(pair: Pair) -> None:
    """The server sees the wish, its code comes back, and the goal ends as cancelled."""
    name = f"{pair.name}/cancelled_there"
    server = await pair.there.action_server(name, FIBONACCI, RESULT, ending="later")
    client: Any = pair.here.create_action_client(FIBONACCI, name)
    assert await client.wait_for_server()
    goal = await client.send_goal(GOAL)
    await server.goals(1)
    response = await goal.cancel()
    assert (response.return_code, len(response.goals_canceling)) == (0, 1)
    await server.end_goals("canceled")
    assert (await goal.result()).status == GoalState.CANCELED


async def test_a_goal_in_callboard_is_cancelled(pair: Pair) -> None:
    """The server sees the wish, its code comes back, and the goal ends as cancelled."""
    name = f"{pair.name}/cancelled_here"
    server = Server(pair.here, name)
    goal = await (await pair.there.action_client(name, FIBONACCI)).send(GOAL)
    await goal.state("accepted")
    assert await goal.cancel() == [0, 1]
    assert server.cancelled.is_set()
    server.ending.set_result("canceled")
    assert (await goal.state("result"))["status"] == CANCELED


async def test_clients_of_both_sides_have_goals_of_their_own(pair: Pair) -> None:
    """A server of ROS and one here each have a client on both sides: every goal has its own result."""
    there, here = f"{pair.name}/of_both_there", f"{pair.name}/of_both_here"
    await pair.there.action_server(there, FIBONACCI, RESULT)
    Server(pair.here, here).ending.set_result("succeed")
    own = [pair.here.create_action_client(FIBONACCI, name) for name in (there, here)]
    theirs = [await pair.there.action_client(name, FIBONACCI) for name in (there, here)]
    for each in own:
        assert await each.wait_for_server()
    sent = await asyncio.gather(*(each.send_goal(GOAL) for each in own))
    goals = [await each.send(GOAL) for each in theirs]
    for goal in sent:
        result = await goal.result()
        assert (result.status, result.result) == (GoalState.SUCCEEDED, RESULT)
    for other in goals:
        state = await other.state("result")
        assert (state["status"], state["result"]) == (SUCCEEDED, RESULT)


async def test_a_goal_ends_when_the_server_of_ros_leaves(pair: Pair) -> None:
    """Its client does not wait for ever."""
    name = f"{pair.name}/leaving"
    server = await pair.there.action_server(name, FIBONACCI, RESULT, ending="later")
    client: Any = pair.here.create_action_client(FIBONACCI, name)
    assert await client.wait_for_server()
    goal = await client.send_goal(GOAL)
    await server.goals(1)
    await server.destroy()
    with pytest.raises((actors.ServiceUnavailable, actors.GoalUnknown)):
        await goal.result()


async def test_a_goal_ends_when_the_process_of_its_server_in_ros_is_killed(pair: Pair) -> None:
    """Its client does not wait for ever: ROS knows that the server is gone when its lease is over."""
    name = f"{pair.name}/killed_there"
    ros = pair.network.ros(lease_sec=3)
    node = await ros.node(f"{pair.name[1:]}_killed")
    server = await node.action_server(name, FIBONACCI, RESULT, ending="later")
    client: Any = pair.here.create_action_client(FIBONACCI, name)
    assert await client.wait_for_server()
    goal = await client.send_goal(GOAL)
    await server.goals(1)
    await ros.kill()
    with pytest.raises((actors.ServiceUnavailable, actors.GoalUnknown)):
        await goal.result()


async def test_a_goal_is_aborted_when_the_process_of_its_server_in_callboard_is_killed(pair: Pair) -> None:
    """Its client in ROS has a result, at once."""
    name = f"{pair.name}/killed_here"
    process = pair.network.process("server", sys.executable, "-c", SERVE, pair.network.url, name)
    goal = await (await pair.there.action_client(name, FIBONACCI)).send(GOAL)
    assert (await goal.state("accepted"))["accepted"], process.output()
    process.kill()
    assert (await goal.state("result"))["status"] == ABORTED
