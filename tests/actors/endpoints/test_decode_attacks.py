"""Messages, requests, replies, goals and feedback that leave out fields, at the nodes that decode them."""

from __future__ import annotations

import asyncio
import logging
import tracemalloc
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.interfaces.action import action_types
from actors.interfaces.example_interfaces.msg import Int64
from actors.interfaces.message import declared_type
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.rcl_interfaces.srv import SetParameters
from actors.interfaces.tf2_msgs.msg import TFMessage
from proto.wire import frames
from proto.wire.codes import Status
from tests.actors.meeting import DEADLINE_SEC, KEEP_ALL, latched, matched, until
from tests.broker import frame_makers as make
from tests.broker.rawclient import link
from tests.hostile.decode_bytes import starved

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting

COUNT = 100_000
MIB = 1024 * 1024


class Plan(actors.Service, type_name="attacks/srv/Plan"):
    """Both of its messages have a sequence of messages."""

    class Request(actors.Message):
        goals: list[Path] = []  # noqa: RUF012 - msgspec copies it

    class Response(actors.Message):
        plans: list[Path] = []  # noqa: RUF012


class Follow(actors.Action, type_name="attacks/action/Follow"):
    """So have its goal and its feedback."""

    class Goal(actors.Message):
        paths: list[Path] = []  # noqa: RUF012

    class Result(actors.Message):
        ok: bool = False

    class Feedback(actors.Message):
        paths: list[Path] = []  # noqa: RUF012


@pytest.mark.parametrize("profile", [10, KEEP_ALL, latched(1)], ids=["keep last", "keep all", "latched"])
async def test_a_subscription_drops_what_leaves_out_too_much(
    meeting: Meeting, caplog: pytest.LogCaptureFixture, profile: Any
) -> None:
    """Case 62: counted and logged; its other messages, and the node's other subscriptions, arrive."""
    name = f"reader_{id(profile)}"  # the throttle of a line is its logger's
    reader, attacker = await meeting.node(name), await meeting.node("attacker")
    transforms, numbers = list[TFMessage](), list[int]()
    attack = attacker.create_publisher(TFMessage, "tf", profile)
    other = attacker.create_publisher(Int64, "number")
    attack.publish_encoded(starved("transforms", COUNT))
    with caplog.at_level(logging.WARNING):
        subscription = reader.create_subscription(TFMessage, "tf", transforms.append, profile)
        reader.create_subscription(Int64, "number", lambda message: numbers.append(message.data))
        await matched(attack)
        await matched(other)
        tracemalloc.start()
        for number in range(3):
            attack.publish_encoded(starved("transforms", COUNT))
            other.publish(Int64(data=number))
        attack.publish(TFMessage())
        await until(lambda: numbers == [0, 1, 2] and transforms == [TFMessage()])
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert subscription.undecodable >= 3
    assert peak < 16 * MIB
    assert "on '/tf'" in caplog.text
    assert "write every field" in caplog.text


async def test_a_raw_subscription_is_not_concerned(meeting: Meeting) -> None:
    """It decodes nothing."""
    node = await meeting.node("node")
    publisher = node.create_publisher(TFMessage, "tf")
    got = list[bytes]()
    node.create_subscription(None, "tf", got.append, raw=True)
    await matched(publisher)
    publisher.publish_encoded(starved("transforms", COUNT))
    await until(lambda: got == [starved("transforms", COUNT)])


async def requested(meeting: Meeting, name: str, srv_type: Any, body: bytes, *calls: int) -> list[Any]:
    """Send requests with a body to a service; return the entries of the replies."""
    async with link(meeting.broker, "/attacker") as client:
        client.send(frames.Client(1, 0, name, *declared_type(srv_type)))
        await client.synchronise()
        client.send(make.request(1, *calls, body=body))
        entries = list[Any]()
        while len(entries) < len(calls):
            entries += (await client.next(frames.Reply)).entries
        return entries


async def test_a_service_refuses_such_a_request(meeting: Meeting, caplog: pytest.LogCaptureFixture) -> None:
    """Case 62: the caller gets a typed error, and the server goes on."""
    server = await meeting.node("server_that_logs")  # the throttle of a line is its logger's
    server.create_service(Plan, "plan", lambda request: Plan.Response(plans=request.goals))
    with caplog.at_level(logging.WARNING):
        (entry,) = await requested(meeting, "/plan", Plan, starved("goals", COUNT), 1)
    assert entry.status == Status.INVALID_REQUEST
    assert b"MessageBudgetError" in entry.body
    assert "Refused a request for '/plan'" in caplog.text
    client = server.create_client(Plan, "plan")
    assert await client.call(Plan.Request(goals=[Path()])) == Plan.Response(plans=[Path()])


async def test_requests_of_suspended_handlers_share_an_allowance(meeting: Meeting) -> None:
    """Case 62: thirty of them hold little more than one."""
    server = await meeting.node("server")
    held, go_on = list[int](), asyncio.Event()

    async def plan(request: Plan.Request) -> Plan.Response:
        held.append(len(request.goals))
        await go_on.wait()
        return Plan.Response()

    server.create_service(Plan, "plan", plan, concurrent=True)
    refused = 0
    async with link(meeting.broker, "/attacker") as client:
        client.send(frames.Client(1, 0, "/plan", *declared_type(Plan)))
        await client.synchronise()
        client.send(make.request(1, *range(30), body=starved("goals", 10_000)))
        while refused + len(held) < 30:
            refused += len((await client.next(frames.Reply)).entries)
    go_on.set()
    assert 1 <= len(held) < 10


async def test_the_parameter_services_of_a_node(meeting: Meeting) -> None:
    """Case 62: every node has them."""
    await meeting.node("node", start_parameter_services=True)
    (entry,) = await requested(
        meeting, "/node/set_parameters", SetParameters, starved("parameters", COUNT), 1
    )
    assert entry.status == Status.INVALID_REQUEST


@pytest.mark.parametrize("frame_length", [10, 1], ids=["one frame", "a frame for each"])
async def test_a_caller_gets_an_error_for_such_a_reply(meeting: Meeting, frame_length: int) -> None:
    """Case 62: of a server that is hostile; calls that wait together share an allowance."""
    node = await meeting.node("node")
    client = node.create_client(Plan, "plan")
    async with link(meeting.broker, "/attacker") as server:
        server.send(
            make.service(1, "/plan")._replace(
                type_name=declared_type(Plan)[0], type_hash=declared_type(Plan)[1]
            )
        )
        await matched(client)
        replies = asyncio.gather(
            *(client.call(Plan.Request(), DEADLINE_SEC) for _ in range(10)), return_exceptions=True
        )
        calls = list[int]()
        while len(calls) < 10:
            calls += [entry.call for entry in (await server.next(frames.Request)).entries]
        for start in range(0, 10, frame_length):
            server.send(make.reply(1, *calls[start : start + frame_length], body=starved("plans", 10_000)))
        ends = await replies
    errors = [end for end in ends if isinstance(end, actors.RemoteError)]
    assert len(errors) >= 8
    assert all("MessageBudgetError" in str(error) for error in errors)


async def test_goals_and_feedback(meeting: Meeting) -> None:
    """Case 62: actions are made of the same services and messages."""
    node = await meeting.node("node")

    async def follow(goal: Any) -> Follow.Result:
        goal.succeed()
        return Follow.Result(ok=True)

    node.create_action_server(Follow, "follow", follow)
    types = action_types(Follow)
    body = b"\x81\xa4goal" + starved("paths", COUNT)
    (entry,) = await requested(meeting, "/follow/_action/send_goal", types.send_goal, body, 1)
    assert entry.status == Status.INVALID_REQUEST
    got = list[Any]()
    subscription = node.create_subscription(types.feedback_message, "follow/_action/feedback", got.append)
    publisher = node.create_publisher(types.feedback_message, "follow/_action/feedback")
    await matched(publisher)
    publisher.publish_encoded(b"\x81\xa8feedback" + starved("paths", COUNT))
    await until(lambda: subscription.undecodable == 1)
    assert got == []
