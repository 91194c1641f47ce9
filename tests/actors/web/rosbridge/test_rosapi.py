"""The services of rosapi."""

from __future__ import annotations

import asyncio
import json
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool
from actors.web.rosbridge.rosapi import CONTROLS, TYPES
from tests.actors.web.rosbridge.test_services import adder

if TYPE_CHECKING:
    import actors
    from tests.actors.meeting import Meeting
    from tests.actors.web.rosbridge.bridge import Bridge


async def _robot(meeting: Meeting) -> actors.Node:
    """Return a node with an endpoint of each kind, and a parameter."""
    node = await adder(meeting, start_parameter_services=True, enable_rosout=True)
    node.create_publisher(String, "/chatter", 10)
    node.create_subscription(String, "/orders", lambda _: None, 10)

    def execute(goal: Any) -> None:
        goal.succeed()

    node.create_action_server(Fibonacci, "/fibonacci", execute)
    node.declare_parameter("speed", 1.5)
    return node


async def test_the_graph(bridge: Bridge, meeting: Meeting) -> None:
    """Its topics, services, actions and nodes, with types that may have names of ROS 1."""
    await _robot(meeting)
    client = await bridge.connect()
    topics = await client.values("/rosapi/topics")
    types = dict(zip(topics["topics"], topics["types"], strict=True))
    assert types["/chatter"] == "std_msgs/msg/String"
    assert "/rosout" in types
    assert "/add" in (await client.values("/rosapi/services"))["services"]
    assert "/adder" in (await client.values("/rosapi/nodes"))["nodes"]
    raw = await client.values("/rosapi/topics_and_raw_types")
    assert "string data" in raw["typedefs_full_text"][raw["topics"].index("/chatter")]
    expected: list[tuple[str, dict[str, str], dict[str, Any]]] = [
        ("topics_for_type", {"type": "std_msgs/String"}, {"topics": ["/chatter", "/orders"]}),
        ("topic_type", {"topic": "chatter"}, {"type": "std_msgs/msg/String"}),
        ("topic_type", {"topic": "/nothing"}, {"type": ""}),
        ("services_for_type", {"type": "example_interfaces/AddTwoInts"}, {"services": ["/add"]}),
        ("service_type", {"service": "/add"}, {"type": "example_interfaces/srv/AddTwoInts"}),
        ("service_type", {"service": "/rosapi/topics"}, {"type": "rosapi_msgs/srv/Topics"}),
        ("service_node", {"service": "/add"}, {"node": "/adder"}),
        ("service_node", {"service": "/nothing"}, {"node": ""}),
        ("service_providers", {"service": "/add"}, {"providers": ["/adder"]}),
        ("publishers", {"topic": "/chatter"}, {"publishers": ["/adder"]}),
        ("subscribers", {"topic": "/orders"}, {"subscribers": ["/adder"]}),
        ("action_servers", {}, {"action_servers": ["/fibonacci"]}),
        ("get_ros_version", {}, {"version": 2, "distro": "kilted"}),
    ]
    for service, args, values in expected:
        assert await client.values(f"/rosapi/{service}", args) == values, service
    details = await client.values("/rosapi/node_details", {"node": "/adder"})
    assert "/orders" in details["subscribing"]
    assert "/chatter" in details["publishing"]
    assert "/add" in details["services"]
    assert (await client.values("/rosapi/get_time"))["time"]["sec"] > 0


async def test_types(bridge: Bridge) -> None:
    """Messages, and both sides of services."""
    client = await bridge.connect()
    found = await client.values("/rosapi/message_details", {"type": "std_msgs/Header"})
    assert [each["type"] for each in found["typedefs"]] == ["std_msgs/Header", "builtin_interfaces/Time"]
    for side, fields in (("request", ["a", "b"]), ("response", ["sum"])):
        args = {"type": "example_interfaces/AddTwoInts"}
        found = await client.values(f"/rosapi/service_{side}_details", args)
        assert found["typedefs"][0]["fieldnames"] == fields
    response = await client.call("/rosapi/message_details", {"type": "std_msgs/Nothing"})
    assert (response["result"], "Nothing" in response["values"]) == (False, True)


async def test_parameters(bridge: Bridge, meeting: Meeting) -> None:
    """By the names of node and parameter, with values in JSON; a type is kept."""
    node = await _robot(meeting)
    client = await bridge.connect()
    names = (await client.values("/rosapi/get_param_names"))["names"]
    assert "/adder:speed" in names
    name = {"name": "/adder:speed"}
    assert await client.values("/rosapi/get_param", name) == {"value": "1.5"}
    assert await client.values("/rosapi/has_param", name) == {"exists": True}
    await client.values("/rosapi/set_param", {**name, "value": "2"})
    assert node.get_parameter("speed").value == 2.0
    response = await client.call("/rosapi/set_param", {**name, "value": '"fast"'})
    assert (response["result"], "speed" in response["values"]) == (False, True)
    response = await client.call("/rosapi/set_param", {**name, "value": "fast"})
    assert "is JSON" in response["values"]
    missing = {"name": "/adder:color"}
    assert await client.values("/rosapi/has_param", missing) == {"exists": False}
    assert await client.values("/rosapi/get_param", {**missing, "default_value": '"red"'}) == {
        "value": '"red"'
    }
    response = await client.call("/rosapi/delete_param", name)
    assert response["result"] is False  # it has been declared with a type
    response = await client.call("/rosapi/get_param", {"name": "speed"})
    assert "/node:parameter" in response["values"]


async def test_parameters_of_a_node_that_does_not_exist(bridge: Bridge) -> None:
    """It is not waited for: the graph says that it is not there."""
    client = await bridge.connect()
    name = {"name": "/nobody:speed"}
    assert await client.values("/rosapi/has_param", name) == {"exists": False}
    assert await client.values("/rosapi/get_param", {**name, "default_value": "3"}) == {"value": "3"}
    for service, values in (("set_param", {**name, "value": "2"}), ("delete_param", name)):
        response = await client.call(f"/rosapi/{service}", values)
        assert response["values"] == "No node '/nobody' serves its parameters now"


async def test_every_service_answers(bridge: Bridge) -> None:
    """Whatever it is asked: with a response, or the reason why there is none."""
    client = await bridge.connect()
    numbers = dict.fromkeys(("topic", "type", "node", "name", "service"), 3)
    requests: tuple[Any, ...] = (None, {}, numbers, [1], ["a", "b", "c"])
    for service in TYPES:
        for args in requests:
            response = await client.call(f"/rosapi/{service}", args)
            assert json.dumps(response["values"])
            assert response["result"] or isinstance(response["values"], str)


async def test_a_node_that_serves_such_a_name_is_called(bridge: Bridge, meeting: Meeting) -> None:
    """Such as a real rosapi in the graph of a bridge."""
    node = await meeting.node("rosapi")

    def answer(_: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.message = "from the node"
        return response

    node.create_service(SetBool, "/rosapi/topics", answer)
    client = await bridge.connect()
    async with asyncio.timeout(60):
        while "message" not in (values := await client.values("/rosapi/topics")):
            await asyncio.sleep(0)
    assert values["message"] == "from the node"


@pytest.mark.parametrize("service", sorted(CONTROLS))
async def test_services_that_change_something_need_control(read_only: Bridge, service: str) -> None:
    """The others do not."""
    client = await read_only.connect()
    response = await client.call(f"/rosapi/{service}", {"name": "/a:b", "value": "1"})
    assert (response["result"], "--allow-control" in response["values"]) == (False, True)
    assert await client.values("/rosapi/topics")
