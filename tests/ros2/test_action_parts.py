"""What actions promise across the bridge when somebody asks twice, too late, or dies."""

from __future__ import annotations

import asyncio
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import actors
from actors import GoalState
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.interfaces.unique_identifier_msgs.msg import UUID
from tests.ros2.ros import interface
from tests.waiting import until

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.ros2.conftest import Pair
    from tests.ros2.network import Network

FIBONACCI: Any = interface("test_msgs/action/Fibonacci")
SEND: Any = FIBONACCI.Impl.SendGoalService
RESULTS: Any = FIBONACCI.Impl.GetResultService
FEEDBACK: Any = FIBONACCI.Impl.FeedbackMessage
GOAL: Any = FIBONACCI.Goal(order=3)
RESULT: Any = FIBONACCI.Result(sequence=[1, 2, 3])
NUMBER = UUID(uuid=bytes(range(16)))
SAME: Any = SEND.Request(goal_id=NUMBER, goal=GOAL)
UNKNOWN, ABORTED = 0, int(GoalState.ABORTED)
UNKNOWN_GOAL = CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID

SERVER = """
import asyncio, sys
import actors
from tests.ros2.test_action_parts import Server

async def main():
    async with actors.Node("dying_server") as node:
        Server(node, sys.argv[1])
        await asyncio.Event().wait()

asyncio.run(main())
"""


class Server:
    """An action server of callboard that aborts its goal when there is another, or at the end.

    Attributes:
        goals: Its goals.
    """

    def __init__(self, node: actors.Node, name: str) -> None:
        self.goals: list[Any] = []
        self._preempted: list[asyncio.Event] = []
        make: Any = node.create_action_server
        make(FIBONACCI, name, self._execute)

    async def _execute(self, goal: Any) -> Any:
        self.end()
        event = asyncio.Event()
        self._preempted.append(event)
        self.goals.append(goal)
        goal.publish_feedback(FIBONACCI.Feedback(sequence=[len(self.goals)]))
        await event.wait()
        goal.abort()
        return RESULT

    def end(self) -> None:
        """Abort all goals."""
        for each in self._preempted:
            each.set()


async def test_a_goal_id_is_used_once_in_ros(pair: Pair) -> None:
    """Of two clients of callboard with one goal id the second is refused; the first has its result."""
    name = f"{pair.name}/same_there"
    server = await pair.there.action_server(name, FIBONACCI, RESULT, ending="later")
    sends: list[Any] = [pair.here.create_client(SEND, f"{name}/_action/send_goal") for _ in range(2)]
    for each in sends:
        assert await each.wait_for_service()
    pair.here.create_subscription(FEEDBACK, f"{name}/_action/feedback", print, 10)  # as action clients have
    assert [(await each.call(SAME)).accepted for each in sends] == [True, False]
    assert await server.goals(1) == [GOAL]
    results: Any = pair.here.create_client(RESULTS, f"{name}/_action/get_result")
    assert await results.wait_for_service()
    asked = [results.call_async(RESULTS.Request(goal_id=NUMBER), None) for _ in range(12)]
    await server.end_goals("succeed")
    assert [(each.status, each.result) for each in await asyncio.gather(*asked)] == [
        (int(GoalState.SUCCEEDED), RESULT)
    ] * 12


async def test_a_goal_id_is_used_once_in_callboard(pair: Pair) -> None:
    """The same of two clients of ROS 2."""
    name = f"{pair.name}/same_here"
    server = Server(pair.here, name)
    sends = [await pair.there.client(f"{name}/_action/send_goal", SEND) for _ in range(2)]
    await pair.there.subscription(f"{name}/_action/feedback", FEEDBACK)
    assert [(await each.call(SAME)).accepted for each in sends] == [True, False]
    await until(lambda: len(server.goals) == 1)
    server.end()


async def test_a_goal_in_callboard_is_preempted_by_another_of_ros(pair: Pair) -> None:
    """The first client gets its end, feedback and result, while the second goal goes on."""
    name = f"{pair.name}/preempted"
    server = Server(pair.here, name)
    client = await pair.there.action_client(name, FIBONACCI)
    first = await client.send(GOAL)
    assert (await first.state("accepted", feedback=1))["feedback"] == [FIBONACCI.Feedback(sequence=[1])]
    second = await client.send(GOAL)
    state = await first.state("result")
    assert (state["status"], state["result"]) == (ABORTED, RESULT)
    assert (await second.state("accepted", feedback=1))["result"] is None
    assert len(server.goals) == 2
    server.end()


async def test_goals_that_nobody_knows_have_their_codes(pair: Pair) -> None:
    """Results and cancellations of unknown goals, in both directions."""
    there, here = f"{pair.name}/codes_there", f"{pair.name}/codes_here"
    await pair.there.action_server(there, FIBONACCI, RESULT)
    Server(pair.here, here)
    cancel = CancelGoal.Request()
    cancel.goal_info.goal_id = NUMBER
    clients: list[Any] = [
        pair.here.create_client(RESULTS, f"{there}/_action/get_result"),
        pair.here.create_client(CancelGoal, f"{there}/_action/cancel_goal"),
    ]
    for each in clients:
        assert await each.wait_for_service()
    assert (await clients[0].call(RESULTS.Request(goal_id=NUMBER))).status == UNKNOWN
    assert (await clients[1].call(cancel)).return_code == UNKNOWN_GOAL
    asked: Any = await (await pair.there.client(f"{here}/_action/get_result", RESULTS)).call(
        RESULTS.Request(goal_id=NUMBER)
    )
    assert asked.status == UNKNOWN
    asked = await (await pair.there.client(f"{here}/_action/cancel_goal", CancelGoal)).call(cancel)
    assert asked.return_code == UNKNOWN_GOAL


async def test_a_goal_of_ros_is_aborted_when_its_server_here_dies(pair: Pair) -> None:
    """Its client gets a result: ROS 2 has no error for it, and it would wait for ever."""
    name = f"{pair.name}/dying"
    server = pair.network.process("dying", sys.executable, "-c", SERVER, name)
    goal = await (await pair.there.action_client(name, FIBONACCI)).send(GOAL)
    await goal.state("accepted", feedback=1)
    server.kill()
    assert (await goal.state("result"))["status"] == ABORTED


async def test_goals_go_on_when_a_client_of_ros_dies(make_network: Callable[[], Network]) -> None:
    """Its results are dropped, and goals of others have theirs."""
    network = make_network()
    network.broker()
    network.bridge()
    async with actors.Node("server", url=network.url) as here:
        server = Server(here, "/work")
        dying, living = network.ros(), network.ros()
        goal = await (await (await dying.node("dying")).action_client("/work", FIBONACCI)).send(GOAL)
        await goal.state("accepted", feedback=1)
        await dying.kill()
        other = await (await (await living.node("living")).action_client("/work", FIBONACCI)).send(GOAL)
        await other.state("accepted", feedback=1)
        await until(lambda: [each.status for each in server.goals[:-1]] == [GoalState.ABORTED])
        third = await (await (await living.node("third")).action_client("/work", FIBONACCI)).send(GOAL)
        await third.state("accepted", feedback=1)
        assert (await other.state("result"))["status"] == ABORTED
        server.end()


async def test_a_server_of_ros_that_is_back_answers_beside_the_dead_one(
    make_network: Callable[[], Network],
) -> None:
    """ROS 2 shows a killed process for its lease of 20 s; the next of its name works at once."""
    network = make_network()
    network.broker()
    network.bridge()
    async with actors.Node("caller", url=network.url) as here:
        first, second = network.ros(), network.ros()
        await (await first.node("worker")).action_server("/work", FIBONACCI, RESULT, ending="later")
        client: Any = here.create_action_client(FIBONACCI, "/work")
        assert await client.wait_for_server()
        assert (await client.send_goal(GOAL)).accepted
        await first.kill()
        await (await second.node("worker")).action_server("/work", FIBONACCI, RESULT)
        result = None
        while result is None:
            # What is sent before the bridge has found the second one, only the dead one gets.
            with suppress(actors.CallFailed):
                result = await (await client.send_goal(GOAL, timeout_sec=2.0)).result()
        assert (result.status, result.result) == (GoalState.SUCCEEDED, RESULT)
