"""`callboard action`: list, info, type, find, send_goal, echo."""

from __future__ import annotations

import asyncio
import re
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any

import pytest

from actors import CancelResponse, GoalResponse
from actors.interfaces.example_interfaces.action import Fibonacci

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator
    from pathlib import Path

    import actors
    from tests.actors.cli.conftest import Desk

TYPE = "example_interfaces/action/Fibonacci"
SEND = ("action", "send_goal", "/fibonacci", TYPE)


async def execute(goal: actors.ServerGoalHandle[Any, Any, Any]) -> Fibonacci.Result:
    """Publish the sequence; order 0 is aborted, and order 99 runs until it is cancelled."""
    sequence = [0, 1]
    if goal.request.order == 99:
        await asyncio.Event().wait()
    for _ in range(goal.request.order):
        sequence.append(sequence[-1] + sequence[-2])
        goal.publish_feedback(Fibonacci.Feedback(sequence=sequence))
    if goal.request.order:
        goal.succeed()
    else:
        goal.abort()
    return Fibonacci.Result(sequence=sequence)


@asynccontextmanager
async def kitchen(desk: Desk) -> AsyncGenerator[actors.ActionServer[Any, Any, Any]]:
    """A node with an action server, and one with a client; orders below zero are rejected."""

    def decide(goal: Fibonacci.Goal) -> GoalResponse:
        return GoalResponse.REJECT if goal.order < 0 else GoalResponse.ACCEPT

    def cancel(goal: object) -> CancelResponse:
        return CancelResponse.ACCEPT

    async with desk.node("server") as server, desk.node("client") as client:
        made = server.create_action_server(
            Fibonacci,
            "fibonacci",
            execute,
            goal_callback=decide,
            cancel_callback=cancel,
            cancel_execution=True,
        )
        client.create_action_client(Fibonacci, "fibonacci")
        client.create_action_client(Fibonacci, "_secret")
        await server.get_graph()
        await client.get_graph()
        yield made


@pytest.mark.parametrize(
    ("arguments", "out"),
    [
        (["list"], "/fibonacci\n"),
        (["list", "-t"], f"/fibonacci [{TYPE}]\n"),
        (["list", "-c"], "1\n"),
        (["list", "--include-hidden-actions"], "/_secret\n/fibonacci\n"),
        (["list", "--json"], f'[{{"name": "/fibonacci", "types": ["{TYPE}"]}}]\n'),
        (["type", "fibonacci"], f"{TYPE}\n"),
        (["find", TYPE], "/fibonacci\n"),
        (["find", "-c", "example_interfaces/Fibonacci"], "1\n"),
        (
            ["info", "/fibonacci"],
            "Action: /fibonacci\nAction clients: 1\n    /client\nAction servers: 1\n    /server\n",
        ),
        (["info", "-c", "fibonacci"], "Action: /fibonacci\nAction clients: 1\nAction servers: 1\n"),
        (
            ["info", "-t", "/fibonacci"],
            (
                f"Action: /fibonacci\nAction clients: 1\n    /client [{TYPE}]\n"
                f"Action servers: 1\n    /server [{TYPE}]\n"
            ),
        ),
        (["info", "/nobodys"], "Action: /nobodys\nAction clients: 0\nAction servers: 0\n"),
        (
            ["info", "--json", "/fibonacci"],
            (
                f'{{"name": "/fibonacci", "types": ["{TYPE}"],'
                f' "clients": [{{"node": "/client", "types": ["{TYPE}"]}}],'
                f' "servers": [{{"node": "/server", "types": ["{TYPE}"]}}]}}\n'
            ),
        ),
    ],
)
async def test_the_graph(desk: Desk, arguments: list[str], out: str) -> None:
    """Names, types and owners, as ROS 2 prints them."""
    async with kitchen(desk):
        assert await desk.callboard("action", *arguments) == (0, out, "")


async def test_an_unknown_action_has_no_type(desk: Desk) -> None:
    """The type of an unknown action is an error that suggests a similar name."""
    async with kitchen(desk):
        ended = await desk.callboard("action", "type", "/fibonaci")
    assert (ended.code, ended.out) == (1, "")
    assert "Unknown action '/fibonaci'; did you mean '/fibonacci'?" in ended.err


async def test_node_info_lists_actions(desk: Desk) -> None:
    """Servers and clients have their sections; the hidden services and topics are left out."""
    async with kitchen(desk):
        server = await desk.callboard("node", "info", "/server")
        client = await desk.callboard("node", "info", "/client", "--json")
    assert f"  Action Servers:\n    /fibonacci: {TYPE}\n  Action Clients:\n\n" in server.out
    assert "_action" not in server.out
    assert client.json["action_clients"] == [{"name": "/fibonacci", "types": [TYPE]}]
    assert client.json["action_servers"] == []


async def test_send_goal_prints_what_ros_prints(desk: Desk) -> None:
    """Waiting, goal, id, feedback, result and status."""
    async with kitchen(desk):
        ended = await desk.callboard(*SEND, "{order: 1}", "--feedback")
    printed = re.sub(r"[0-9a-f]{32}", "ID", ended.out)
    assert (ended.code, ended.err) == (0, "")
    assert printed == (
        "Waiting for an action server to become available...\n"
        "Sending goal:\n     order: 1\n\n"
        "Goal accepted with ID: ID\n\n"
        "Feedback:\n    sequence:\n- 0\n- 1\n- 1\n\n"
        "Result:\n    sequence:\n- 0\n- 1\n- 1\n\n"
        "Goal finished with status: SUCCEEDED\n"
    )


async def test_send_goal_prints_json(desk: Desk) -> None:
    """An object for each feedback, if wanted, and one for the end."""
    async with kitchen(desk):
        feedback, end = (await desk.callboard(*SEND, "{order: 1}", "-f", "--json")).documents
        (alone,) = (await desk.callboard(*SEND, "{order: 1}", "--json")).documents
    assert feedback == {"feedback": {"sequence": [0, 1, 1]}}
    assert end["status"] == alone["status"] == "SUCCEEDED"
    assert end["result"] == {"sequence": [0, 1, 1]}
    assert len(bytes.fromhex(end["goal_id"])) == 16


async def test_send_goal_fails_if_the_goal_does_not_succeed(desk: Desk) -> None:
    """Rejected and aborted goals are failures, and so are types that do not fit."""
    async with kitchen(desk):
        rejected = await desk.callboard(*SEND, "{order: -1}")
        aborted = await desk.callboard(*SEND)
        wrong = await desk.callboard("action", "send_goal", "/fibonacci", "std_srvs/srv/Trigger")
    assert (rejected.code, rejected.err) == (1, "Goal was rejected.\n")
    assert (aborted.code, aborted.out.splitlines()[-1]) == (1, "Goal finished with status: ABORTED")
    assert wrong.code == 1
    assert "'std_srvs/srv/Trigger' is not an action type" in wrong.err


async def test_send_goal_cancels_the_goal_after_its_timeout(desk: Desk) -> None:
    """The server sees the cancellation; without a server there is nothing to cancel."""
    async with kitchen(desk) as server:
        ended = await desk.callboard(*SEND, "{order: 99}", "--timeout", "3")
        assert server.active == 0
    assert ended.code == 124
    assert "Canceling goal...\nGoal finished with status: CANCELED\n" in ended.err
    alone = await desk.callboard(*SEND, "--timeout", "0.05")
    assert (alone.code, "Canceling" in alone.err) == (124, False)


async def test_echo_prints_feedback_and_states(desk: Desk) -> None:
    """`action echo` prints the messages of both topics, each as a document of its own."""
    async with kitchen(desk), desk.node("sender") as node:
        client = node.create_action_client(Fibonacci, "fibonacci")
        echo = desk.start("action", "echo", "/fibonacci", "--json", "--timeout", "3")
        for topic in ("feedback", "status"):  # of both clients, and of the command
            while await node.count_subscribers(f"/fibonacci/_action/{topic}") < 3:
                await asyncio.sleep(0)
        await (await client.send_goal(Fibonacci.Goal(order=1))).result()
        ended = await echo
    documents = ended.documents
    assert {"sequence": [0, 1, 1]} in [each.get("feedback") for each in documents]
    assert 4 in [each["status_list"][0]["status"] for each in documents if "status_list" in each]


async def test_echo_of_an_unknown_action(desk: Desk) -> None:
    """The error for an unknown action says how to wait for one that is still to come."""
    ended = await desk.callboard("action", "echo", "/nobodys")
    assert ended.code == 1
    assert "Unknown action '/nobodys'; to wait for it, name its type: callboard action echo" in ended.err


async def test_goals_from_stdin(desk: Desk, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """One after the other; the exit code is 1 if one of them does not succeed."""
    goals, failing = tmp_path / "goals", tmp_path / "failing"
    goals.write_text('order: 1\n---\n{"order": 2}\n', encoding="utf-8")
    failing.write_text("order: 0\n---\norder: 1\n", encoding="utf-8")
    async with kitchen(desk):
        ended = []
        for file in (goals, failing):
            with file.open(encoding="utf-8") as stream:
                monkeypatch.setattr("sys.stdin", stream)
                ended.append(await desk.callboard(*SEND, "--stdin", "--json"))
        both = await desk.callboard(*SEND, "{order: 1}", "--stdin")
    assert [each.code for each in ended] == [0, 1]
    assert [document["result"]["sequence"] for document in ended[0].documents] == [[0, 1, 1], [0, 1, 1, 2]]
    assert [document["status"] for document in ended[1].documents] == ["ABORTED", "SUCCEEDED"]
    assert (both.code, both.err) == (2, "Give VALUES or --stdin, not both\n")
