"""Goals that clients of rosbridge send, and actions that they execute."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.actions.states import GoalState
from actors.errors import ServiceUnavailable
from actors.interfaces.example_interfaces.action import Fibonacci
from tests.actors.meeting import until

if TYPE_CHECKING:
    from actors.actions.client import ActionClient
    from tests.actors.meeting import Meeting
    from tests.actors.web.rosbridge.bridge import Bridge, RosbridgeClient

ACTION = "/fibonacci"
KIND = "example_interfaces/Fibonacci"


async def _executing(meeting: Meeting) -> None:
    """Let a node execute goals: one of order 1 waits until it is cancelled, one of order 13 is rejected."""
    node = await meeting.node("executor")

    async def execute(goal: Any) -> Fibonacci.Result:
        goal.publish_feedback(Fibonacci.Feedback(sequence=[goal.request.order]))
        if goal.request.order == 1:
            await until(lambda: goal.is_cancel_requested)
            goal.canceled()
        elif goal.request.order == 2:
            goal.abort()
        else:
            goal.succeed()
        return Fibonacci.Result(sequence=[goal.request.order, 7])

    def admit(goal: Fibonacci.Goal) -> actors.GoalResponse:
        return actors.GoalResponse.REJECT if goal.order == 13 else actors.GoalResponse.ACCEPT

    def cancel(_: object) -> actors.CancelResponse:
        return actors.CancelResponse.ACCEPT

    node.create_action_server(Fibonacci, ACTION, execute, goal_callback=admit, cancel_callback=cancel)


async def _send(client: RosbridgeClient, order: int, **fields: Any) -> None:
    fields = {"args": {"order": order}, "feedback": True, **fields}
    await client.send("send_action_goal", id=f"goal:{order}", action=ACTION, action_type=KIND, **fields)


@pytest.mark.parametrize(("order", "status"), [(5, GoalState.SUCCEEDED), (2, GoalState.ABORTED)])
async def test_a_goal(bridge: Bridge, meeting: Meeting, order: int, status: GoalState) -> None:
    """Its feedback and its result, with its id; an aborted one has a result, too."""
    await _executing(meeting)
    client = await bridge.connect()
    await _send(client, order)
    head = {"id": f"goal:{order}", "action": ACTION}
    assert await client.next() == {"op": "action_feedback", **head, "values": {"sequence": [order]}}
    assert await client.next() == {
        "op": "action_result", **head, "values": {"sequence": [order, 7]}, "status": status, "result": True
    }  # fmt: skip
    await _send(client, order, feedback=False)
    assert (await client.next())["op"] == "action_result"


async def test_a_goal_is_cancelled(bridge: Bridge, meeting: Meeting) -> None:
    """By its id; its result says so."""
    await _executing(meeting)
    client = await bridge.connect()
    await _send(client, 1)
    assert (await client.next())["op"] == "action_feedback"
    await _send(client, 1)
    assert "has not ended" in (await client.next())["values"]
    await client.send("cancel_action_goal", id="goal:1", action=ACTION)
    assert (await client.next())["status"] == GoalState.CANCELED
    await client.send("cancel_action_goal", id="goal:1", action=ACTION)
    assert "no goal with this id" in (await client.next())["msg"]


@pytest.mark.parametrize(
    ("order", "fields", "text"),
    [
        (13, {}, "rejected"),
        (0, {"args": {"order": "five"}}, "Fibonacci_Goal.order"),
        (0, {"action": "/nothing"}, "has no server"),
        (0, {"action_type": "std_msgs/Nothing"}, "does not say"),
    ],
)
async def test_a_goal_that_fails_says_why(
    bridge: Bridge, meeting: Meeting, order: int, fields: dict[str, Any], text: str
) -> None:
    """In its result."""
    await _executing(meeting)
    client = await bridge.connect()
    goal = {"action": ACTION, "action_type": KIND, "args": {"order": order}, **fields}
    await client.send("send_action_goal", id="x", **goal)
    result = await client.next()
    assert (result["op"], result["id"], result["result"], result["status"]) == (
        "action_result",
        "x",
        False,
        0,
    )
    assert text in result["values"]


async def _sender(meeting: Meeting) -> ActionClient[Any, Any, Any]:
    client = (await meeting.node("sender")).create_action_client(Fibonacci, ACTION)
    assert await client.wait_for_server()
    return client


async def _executor(bridge: Bridge) -> RosbridgeClient:
    """Return a client of rosbridge that executes an action."""
    client = await bridge.connect()
    await client.send("advertise_action", action=ACTION, type=KIND)
    return client


async def test_a_client_executes_a_goal(bridge: Bridge, meeting: Meeting) -> None:
    """A node gets its feedback and its result."""
    executor = await _executor(bridge)
    sender = await _sender(meeting)
    goal = await sender.send_goal(Fibonacci.Goal(order=4))
    request = await executor.next()
    assert (request["op"], request["action"], request["args"]) == ("send_action_goal", ACTION, {"order": 4})
    head = {"id": request["id"], "action": ACTION}
    await executor.send("action_feedback", **head, values={"sequence": [1]})
    await executor.send("action_result", **head, values={"sequence": [2]}, status=4, result=True)
    assert [[*each.sequence] async for each in goal] == [[1]]
    outcome = await goal.result()
    assert (outcome.status, [*outcome.result.sequence]) == (GoalState.SUCCEEDED, [2])


@pytest.mark.parametrize(
    ("fields", "status"),
    [
        ({"status": 6, "values": {}}, GoalState.ABORTED),
        ({"status": 5, "values": {}}, GoalState.ABORTED),  # nobody has cancelled it
        ({"status": 99, "values": {}}, GoalState.ABORTED),
        ({"status": 4, "values": {"color": 1}}, GoalState.ABORTED),
        ({"result": False, "values": "It is broken"}, GoalState.ABORTED),
    ],
)
async def test_other_ends_of_a_goal(
    bridge: Bridge, meeting: Meeting, fields: dict[str, Any], status: GoalState
) -> None:
    """Whatever the client says, the goal ends."""
    executor = await _executor(bridge)
    sender = await _sender(meeting)
    goal = await sender.send_goal(Fibonacci.Goal(order=4))
    request = await executor.next()
    await executor.send("action_result", id=request["id"], action=ACTION, **fields)
    assert (await goal.result()).status is status


async def test_a_client_is_asked_to_cancel(bridge: Bridge, meeting: Meeting) -> None:
    """It says when the goal has ended."""
    executor = await _executor(bridge)
    sender = await _sender(meeting)
    goal = await sender.send_goal(Fibonacci.Goal(order=4))
    request = await executor.next()
    await goal.cancel()
    assert await executor.next() == {"op": "cancel_action_goal", "id": request["id"], "action": ACTION}
    await executor.send("action_result", id=request["id"], action=ACTION, status=5, values={}, result=True)
    assert (await goal.result()).status is GoalState.CANCELED


async def test_goals_of_a_client_that_leaves_fail(bridge: Bridge, meeting: Meeting) -> None:
    """At once."""
    executor = await _executor(bridge)
    sender = await _sender(meeting)
    goal = await sender.send_goal(Fibonacci.Goal(order=4))
    await executor.next()
    await executor.socket.close()
    with pytest.raises(ServiceUnavailable):
        await goal.result()


async def test_goals_that_the_client_does_not_have(bridge: Bridge) -> None:
    """Are errors."""
    client = await _executor(bridge)
    for op in ("action_feedback", "action_result"):
        await client.send(op, id="x", action=ACTION, values={})
        assert "no goal with this id" in (await client.next())["msg"]
    await client.send("unadvertise_action", action="/other")
    assert "has not advertised" in (await client.next())["msg"]
    await client.send("unadvertise_action", action=ACTION)
    await asyncio.wait_for(client.settled(), 60)
