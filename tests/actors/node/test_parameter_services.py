"""A node's parameter services and its parameter events, as another node meets them."""

from __future__ import annotations

import logging
import re
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors import LoggingSeverity
from actors.interfaces.rcl_interfaces import msg, srv
from actors.parameters.errors import ParameterModifiedInCallbackError, ParameterNotDeclaredError
from actors.parameters.requests import MAX_ITEMS
from actors.parameters.types import (
    FloatingPointRange,
    IntegerRange,
    Parameter,
    ParameterDescriptor,
    ParameterType,
    SetParametersResult,
)
from broker import Broker, BrokerOptions
from tests.actors.meeting import matched, until

if TYPE_CHECKING:
    from pathlib import Path

    from tests.actors.meeting import Meeting

SERVICES: dict[str, Any] = {
    "describe_parameters": srv.DescribeParameters,
    "get_parameter_types": srv.GetParameterTypes,
    "get_parameters": srv.GetParameters,
    "list_parameters": srv.ListParameters,
    "set_parameters": srv.SetParameters,
    "set_parameters_atomically": srv.SetParametersAtomically,
}


class Remote:
    """Calls the parameter services of `/ns/server`, and keeps its events."""

    def __init__(self, node: actors.Node) -> None:
        self.events: list[msg.ParameterEvent] = []
        self.subscription = node.create_subscription(
            msg.ParameterEvent, "/parameter_events", self.events.append, 100
        )
        self._clients: dict[str, Any] = {
            name: node.create_client(kind, f"/ns/server/{name}") for name, kind in SERVICES.items()
        }

    async def call(self, name: str, **fields: Any) -> Any:
        await self._clients[name].wait_for_service()
        return await self._clients[name].call(SERVICES[name].Request(**fields))

    async def set(self, **values: Any) -> list[tuple[bool, str]]:
        wanted = [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]
        response = await self.call("set_parameters", parameters=wanted)
        return [(each.successful, each.reason) for each in response.results]


@pytest.fixture
async def server(meeting: Meeting) -> actors.Node:
    return await meeting.node("server", namespace="ns", start_parameter_services=True)


@pytest.fixture
async def remote(meeting: Meeting, server: actors.Node) -> Remote:
    made = Remote(await meeting.node("caller"))
    await matched(made.subscription)
    return made


def named(parameters: list[msg.Parameter]) -> dict[str, Any]:
    return {each.name: Parameter.from_parameter_msg(each).value for each in parameters}


async def test_each_node_has_them(meeting: Meeting, server: actors.Node) -> None:
    """ROS 2's names and types; off with `start_parameter_services=False`."""
    await meeting.node("silent")
    found = dict(await server.get_service_names_and_types())
    assert found == {
        f"/ns/server/{name}": [f"rcl_interfaces/srv/{kind.__name__}"] for name, kind in SERVICES.items()
    }
    (info,) = await server.get_publishers_info_by_topic("/parameter_events")
    assert (info.node_name, info.topic_type) == ("server", "rcl_interfaces/msg/ParameterEvent")
    assert (info.qos_profile.depth, info.qos_profile.durability) == (1000, actors.DurabilityPolicy.VOLATILE)


@pytest.mark.parametrize(
    "value",
    [True, -7, 2.5, "text", b"\x00\xff", [True, False], [1, -2], [0.5, 1.0], ["a", "b"]],
)
async def test_values_of_every_type_arrive(server: actors.Node, remote: Remote, value: Any) -> None:
    """Each type of value can be set and read from another node."""
    server.declare_parameter("p", value)
    assert await remote.set(p=value) == [(True, "")]
    response = await remote.call("get_parameters", names=["p"])
    kind = ParameterType.from_parameter_value(value)
    assert Parameter("p", kind, value) == server.get_parameter("p")
    assert response.values == [server.get_parameter("p").get_parameter_value()]
    assert bytes((await remote.call("get_parameter_types", names=["p"])).types) == bytes([kind])


async def test_unknown_names(server: actors.Node, remote: Remote) -> None:
    """As rclpy: no value, type NOT_SET, an empty description; setting one fails with the reason."""
    server.declare_parameter("typed", ParameterType.INTEGER)
    names = ["no", "typed"]
    assert (await remote.call("get_parameters", names=names)).values == [msg.ParameterValue()] * 2
    assert bytes((await remote.call("get_parameter_types", names=names)).types) == b"\x00\x00"
    described = (await remote.call("describe_parameters", names=names)).descriptors
    assert [each.name for each in described] == ["", "typed"]
    ((successful, reason),) = await remote.set(no=1)
    assert not successful
    assert reason == "Invalid access to undeclared parameter(s): no"


async def test_descriptions(server: actors.Node, remote: Remote) -> None:
    """A descriptor arrives with its ranges."""
    descriptor = ParameterDescriptor(
        description="how fast",
        floating_point_range=(FloatingPointRange(from_value=0.0, to_value=5.0, step=0.5),),
        integer_range=(IntegerRange(from_value=1, to_value=9, step=2),),
    )
    server.declare_parameter("speed", 1.0, descriptor)
    (described,) = (await remote.call("describe_parameters", names=["speed"])).descriptors
    assert ParameterDescriptor.from_msg(described) == server.describe_parameter("speed")
    ((successful, reason),) = await remote.set(speed=4.25)
    assert not successful
    assert "speed is not close enough to a valid step" in reason


async def test_lists(server: actors.Node, remote: Remote) -> None:
    """Names and prefixes, below prefixes and to a depth."""
    server.declare_parameters("arm", [("speed", 1), ("joint.a", 1)])
    result = (await remote.call("list_parameters", prefixes=["arm"], depth=1)).result
    assert (result.names, result.prefixes) == (["arm.speed"], ["arm"])
    every = (await remote.call("list_parameters")).result
    assert set(every.names) == {"arm.speed", "arm.joint.a", "use_sim_time", "start_type_description_service"}


async def test_sets_are_per_item_or_atomic(server: actors.Node, remote: Remote) -> None:
    """`set_parameters` sets what it can, set_parameters_atomically all or nothing."""
    server.declare_parameters("", [("a", 1), ("b", 1)])
    assert [each for each, _ in await remote.set(a=2, b="text")] == [True, False]
    both = [Parameter("a", value=3).to_parameter_msg(), Parameter("b", value="text").to_parameter_msg()]
    result = (await remote.call("set_parameters_atomically", parameters=both)).result
    assert (result.successful, result.reason[:20]) == (False, "Wrong parameter type")
    assert (server.get_parameter("a").value, server.get_parameter("b").value) == (2, 1)


async def test_a_value_of_no_type_is_refused(server: actors.Node, remote: Remote) -> None:
    """A peer in another language may send any number as the type."""
    server.declare_parameter("a", 1)
    wrong = msg.Parameter(name="a", value=msg.ParameterValue(type=77))
    (result,) = (await remote.call("set_parameters", parameters=[wrong])).results
    assert (result.successful, result.reason) == (False, "77 is not a valid ParameterType")


async def test_events(server: actors.Node, remote: Remote) -> None:
    """One event for each operation, split into new, changed and deleted, with the node's full name."""
    server.declare_parameter("a", 1)
    server.declare_parameter("b", 1, ParameterDescriptor(dynamic_typing=True))
    server.set_parameters_atomically([Parameter("a", value=2), Parameter("b")])
    server.undeclare_parameter("a")
    await until(lambda: len(remote.events) == 4)
    assert {event.node for event in remote.events} == {"/ns/server"}
    assert all(event.stamp.sec for event in remote.events)
    found = [
        (named(event.new_parameters), named(event.changed_parameters), named(event.deleted_parameters))
        for event in remote.events
    ]
    assert found == [
        ({"a": 1}, {}, {}),
        ({"b": 1}, {}, {}),
        ({}, {"a": 2}, {"b": None}),
        ({}, {}, {"a": None}),
    ]


async def test_refused_values_make_no_event(server: actors.Node, remote: Remote) -> None:
    """A refused value is not published on /parameter_events."""
    server.declare_parameter("a", 1)
    await remote.set(a="text")
    server.add_on_set_parameters_callback(lambda _: SetParametersResult(successful=False, reason="no"))
    assert await remote.set(a=2) == [(False, "no")]
    await until(lambda: remote.events)
    assert [named(event.new_parameters) for event in remote.events] == [{"a": 1}]


async def test_a_set_callback_may_not_set(server: actors.Node, remote: Remote) -> None:
    """A callback that sets while it decides gets an error, and so does the caller; nothing is set."""
    server.declare_parameters("", [("a", 1), ("b", 1)])

    def meddle(parameters: list[Parameter]) -> SetParametersResult:
        with pytest.raises(ParameterModifiedInCallbackError):
            server.declare_parameter("c", 1)
        server.set_parameters([Parameter("b", value=2)])
        return SetParametersResult(successful=True)

    server.add_on_set_parameters_callback(meddle)
    with pytest.raises(actors.RemoteError, match="ParameterModifiedInCallbackError"):
        await remote.set(a=2)
    server.remove_on_set_parameters_callback(meddle)
    assert (server.get_parameter("a").value, server.get_parameter("b").value) == (1, 1)
    assert await remote.set(a=2) == [(True, "")]


async def test_a_post_set_callback_may_set(server: actors.Node, remote: Remote) -> None:
    """What follows from a value may be set after it; its event comes after the first one."""
    server.declare_parameters("", [("a", 1), ("b", 1)])

    def follow(parameters: list[Parameter]) -> None:
        if parameters[0].name == "a":
            server.set_parameters([Parameter("b", value=parameters[0].value)])

    server.add_post_set_parameters_callback(follow)
    assert await remote.set(a=5) == [(True, "")]
    await until(lambda: len(remote.events) == 4)
    assert [named(event.changed_parameters) for event in remote.events[2:]] == [{"a": 5}, {"b": 5}]


def test_set_callbacks_are_plain_functions() -> None:
    """An `async def` is refused when it is added: nothing would await it."""

    async def callback(parameters: list[Parameter]) -> Any:
        return parameters

    node = actors.Node("n", use_global_arguments=False)
    for add in (
        node.add_pre_set_parameters_callback,
        node.add_on_set_parameters_callback,
        node.add_post_set_parameters_callback,
    ):
        with pytest.raises(TypeError, match="must be a plain function"):
            add(callback)  # type: ignore[arg-type]
    node.destroy_node()


async def test_changes_before_the_first_session_are_published(meeting: Meeting, remote: Remote) -> None:
    """Parameters that a constructor declares reach those that watch already, overrides too."""
    node = meeting.absent(
        "late",
        start_parameter_services=True,
        parameter_overrides={"b": 2},
        automatically_declare_parameters_from_overrides=True,
    )
    node.declare_parameter("a", 1)
    async with node:
        await until(lambda: len(remote.events) == 2)
    assert [named(event.new_parameters) for event in remote.events] == [{"b": 2}, {"a": 1}]


def test_a_nodes_own_types() -> None:
    """As the service gives them: NOT_SET without a value. An undeclared one is an error, unless allowed."""
    node = actors.Node("n", start_parameter_services=False, use_global_arguments=False)
    node.declare_parameters("", [("a", 1), ("b", [1.0]), ("typed", ParameterType.STRING), ("empty",)])
    types = [ParameterType.INTEGER, ParameterType.DOUBLE_ARRAY, ParameterType.NOT_SET, ParameterType.NOT_SET]
    assert node.get_parameter_types(["a", "b", "typed", "empty"]) == types
    assert node.get_parameter_type("a") is Parameter.Type.INTEGER
    with pytest.raises(ParameterNotDeclaredError):
        node.get_parameter_type("other")
    open_node = actors.Node("m", allow_undeclared_parameters=True, use_global_arguments=False)
    assert open_node.get_parameter_types(["other"]) == [ParameterType.NOT_SET]


async def test_a_destroyed_node_can_still_be_set(meeting: Meeting) -> None:
    """Setting a parameter of a node that has ended is no error, as before."""
    node = await meeting.node("gone")
    node.declare_parameter("a", 1)
    node.destroy_node()
    assert node.set_parameters([Parameter("a", value=2)])[0].successful


def test_a_name_too_long_for_services(caplog: pytest.LogCaptureFixture) -> None:
    """A node whose name leaves no space for the services' names has none, and says so."""
    with caplog.at_level(logging.WARNING):
        node = actors.Node("n" * 240)
    assert "too long for parameter services" in caplog.text
    node.destroy_node()


async def test_a_broker_may_refuse_them(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A user without the rights has a node that works; only the debug log says what is missing."""
    rules = tmp_path / "access.toml"
    rules.write_text(
        '[local]\nuser = "guest"\n[users.guest]\nroles = ["guest"]\n[roles.guest]\nallow.node = ["/**"]\n'
    )
    async with Broker(BrokerOptions(port=0, auth=rules)) as broker:
        node = actors.Node("guest", url=broker.url, use_global_arguments=False)
        node.get_logger().set_level(LoggingSeverity.DEBUG)
        with caplog.at_level(logging.DEBUG):
            async with node:
                node.declare_parameter("a", 1)
                await node.get_graph()
                assert node.set_parameters([Parameter("a", value=2)])[0].successful
    told = [record for record in caplog.records if record.name == "callboard.guest"]
    assert {record.levelname for record in told} == {"DEBUG"}
    refused = sum("refused a standard" in record.message for record in told)
    assert (
        refused == len(SERVICES) + 4
    )  # /rosout, /parameter_events, ~/get_type_description, ~/get_diagnostics
    node.get_logger().set_level(LoggingSeverity.UNSET)


async def test_they_are_declared_without_definitions(meeting: Meeting, server: actors.Node) -> None:
    """Every client has rcl_interfaces; 20 KB from each node would be most of what it declares."""
    assert meeting.broker.stats().definitions == 0
    assert len(await server.get_service_names_and_types()) == len(SERVICES)


async def test_a_request_cannot_hold_the_node_for_long(server: actors.Node, remote: Remote) -> None:
    """Too many names have an empty answer, and too many values are refused."""
    server.declare_parameter("a", 1)
    many = [f"name{number}" for number in range(MAX_ITEMS + 1)]
    assert (await remote.call("get_parameters", names=many)).values == []
    assert (await remote.call("describe_parameters", names=many)).descriptors == []
    assert bytes((await remote.call("get_parameter_types", names=many)).types) == b""
    wanted = [Parameter("a", value=2).to_parameter_msg()] * (MAX_ITEMS + 1)
    assert (await remote.call("set_parameters", parameters=wanted)).results == []
    result = (await remote.call("set_parameters_atomically", parameters=wanted)).result
    assert (result.successful, result.reason) == (False, f"more than {MAX_ITEMS} parameters")
    assert server.get_parameter("a").value == 1


async def test_a_reply_is_not_built_beyond_the_limit(server: actors.Node, remote: Remote) -> None:
    """A large value that is asked for many times is an error before it is encoded as many times."""
    value = "x" * 200_000
    server.declare_parameter("a", value)
    with pytest.raises(actors.RemoteError, match="over the limit") as caught:
        await remote.call("get_parameters", names=["a"] * 1000)
    size, limit = map(int, re.findall(r"\d+", str(caught.value)))
    assert limit < size <= limit + len(value)
    assert len((await remote.call("get_parameters", names=["a"] * 2)).values) == 2


async def test_a_refused_name_is_quoted_in_part(remote: Remote) -> None:
    """The reason for refusing a huge name is short: it is one of many in a reply, and a line of a log."""
    ((successful, reason),) = await remote.set(**{"\0" * 1_000_000: 1})
    assert not successful
    assert reason.startswith("Invalid access to undeclared parameter(s): \\x00")
    assert len(reason) < 1000
