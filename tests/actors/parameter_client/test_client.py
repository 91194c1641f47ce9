"""Parameters of another node, read and set through a ParameterClient."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actors import (
    Parameter,
    ParameterClient,
    ParameterDescriptor,
    ParameterType,
    RemoteError,
    ServiceUnavailable,
    SetParametersResult,
)
from actors.interfaces.rcl_interfaces import msg, srv
from actors.parameters.errors import InvalidParameterFileError
from proto.errors import InvalidServiceNameError
from tests.actors.meeting import turns, until

if TYPE_CHECKING:
    from pathlib import Path

    import actors
    from tests.actors.meeting import Meeting

OK = SetParametersResult(successful=True)


@pytest.fixture
async def server(meeting: Meeting) -> actors.Node:
    node = await meeting.node("server", namespace="ns", start_parameter_services=True)
    node.declare_parameters("", [("speed", 1.0), ("arm.joints", [1, 2]), ("name", "x")])
    return node


@pytest.fixture
async def client(meeting: Meeting, server: actors.Node) -> ParameterClient:
    made = ParameterClient(await meeting.node("caller"), "/ns/server")
    assert await made.wait_for_services(10)
    return made


async def test_get(client: ParameterClient) -> None:
    """Values are returned in the order of the names, None for what is not declared."""
    found = await client.get_parameters(["name", "no", "arm.joints"])
    assert [(each.name, each.value) for each in found] == [
        ("name", "x"),
        ("no", None),
        ("arm.joints", [1, 2]),
    ]
    types = await client.get_parameter_types(["speed", "no"])
    assert types == [ParameterType.DOUBLE, ParameterType.NOT_SET]


async def test_set(client: ParameterClient, server: actors.Node) -> None:
    """Parameters are set one by one, or atomically all or none."""
    good, bad = Parameter("speed", value=2.0), Parameter("name", value=1)
    results = await client.set_parameters([good, bad])
    assert [each.successful for each in results] == [True, False]
    together = await client.set_parameters_atomically([Parameter("speed", value=3.0), bad])
    assert together.reason.startswith("Wrong parameter type")
    assert server.get_parameter("speed").value == 2.0
    assert await client.set_parameters_atomically([good]) == OK


async def test_list_and_describe(client: ParameterClient, server: actors.Node) -> None:
    """Names below a prefix; descriptors as the node has them."""
    assert (await client.list_parameters(["arm"])).names == ["arm.joints"]
    assert "arm.joints" not in (await client.list_parameters(depth=1)).names
    found = await client.describe_parameters(["speed", "no"])
    assert found == [server.describe_parameter("speed"), ParameterDescriptor()]


async def test_an_empty_array_has_the_declared_type(client: ParameterClient, server: actors.Node) -> None:
    """An empty list sets an array of any type; its type is read, and other empty values are refused."""
    seen: list[Parameter] = []
    server.add_post_set_parameters_callback(seen.extend)
    empty = Parameter("arm.joints", ParameterType.INTEGER_ARRAY, [])
    assert await client.set_parameters([Parameter("arm.joints", value=[])]) == [OK]
    assert [*seen, server.get_parameter("arm.joints")] == [empty, empty]
    assert await client.get_parameters(["arm.joints"]) == [empty]
    wrong = [Parameter("arm.joints", value=""), Parameter("speed", value=[])]
    assert not any(each.successful for each in await client.set_parameters(wrong))


async def test_delete(client: ParameterClient, server: actors.Node) -> None:
    """A parameter of a dynamic type can be removed, one of a static type not."""
    server.declare_parameter("extra", 1, ParameterDescriptor(dynamic_typing=True))
    removed, kept = await client.delete_parameters(["extra", "speed"])
    assert (removed, kept.reason) == (OK, "Static parameter cannot be undeclared")
    assert not server.has_parameter("extra")


async def test_load_a_file(client: ParameterClient, server: actors.Node, tmp_path: Path) -> None:
    """What the file has for the node is set, with use_wildcard also what it has for patterns."""
    file = tmp_path / "some.yaml"
    file.write_text("/ns/server: {ros__parameters: {speed: 7.0}}\n/**: {ros__parameters: {name: all}}\n")
    assert await client.load_parameter_file(file) == {"speed": OK}
    assert (server.get_parameter("speed").value, server.get_parameter("name").value) == (7.0, "x")
    assert await client.load_parameter_file(file, use_wildcard=True) == {"speed": OK, "name": OK}
    assert server.get_parameter("name").value == "all"
    file.write_text("/other: {ros__parameters: {speed: 7.0}}\n")
    with pytest.raises(InvalidParameterFileError, match="no parameters of /ns/server"):
        await client.load_parameter_file(file)


async def test_names_are_relative_to_the_namespace(meeting: Meeting, server: actors.Node) -> None:
    """As any name; a malformed one is an error at once."""
    near = await meeting.node("near", namespace="ns")
    client = ParameterClient(near, "server")
    assert client.remote_node_name == "/ns/server"
    assert (await client.get_parameters(["speed"]))[0].value == 1.0
    with pytest.raises(InvalidServiceNameError):
        ParameterClient(near, "no?")


async def test_waiting(meeting: Meeting) -> None:
    """Without the node its services are not ready, and a call fails at once."""
    client = ParameterClient(await meeting.node("caller"), "/late")
    assert not client.services_are_ready()
    assert not await client.wait_for_services(0)
    with pytest.raises(ServiceUnavailable):
        await client.get_parameters(["a"])
    late = await meeting.node("late", start_parameter_services=True)
    assert await client.wait_for_services(10)
    assert client.services_are_ready()
    late.destroy_node()
    await until(lambda: not client.services_are_ready())
    client.destroy()


async def test_errors_of_callbacks_arrive(client: ParameterClient, server: actors.Node) -> None:
    """A callback that raises is a RemoteError; nothing is set."""

    def boom(parameters: list[Parameter]) -> SetParametersResult:
        raise OSError("no disk")

    server.add_on_set_parameters_callback(boom)
    with pytest.raises(RemoteError, match="OSError: no disk"):
        await client.set_parameters([Parameter("speed", value=9.0)])
    assert server.get_parameter("speed").value == 1.0


@pytest.mark.parametrize(
    ("values", "text"),
    [([], "0 items for 1 parameters"), ([msg.ParameterValue(type=77)], "77 is not a valid ParameterType")],
)
async def test_invalid_replies(meeting: Meeting, values: list[Any], text: str) -> None:
    """Another implementation may answer anything; that is an error of the call."""
    other = await meeting.node("other")
    response = srv.GetParameters.Response(values=values)
    other.create_service(srv.GetParameters, "/other/get_parameters", lambda request: response)
    client = ParameterClient(await meeting.node("caller"), "/other")
    await turns()
    with pytest.raises(RemoteError, match=text):
        await client.get_parameters(["a"])


async def test_a_callback_may_ask_its_own_node(server: actors.Node) -> None:
    """A node may call its own parameter services, also in a callback."""
    client = ParameterClient(server, "server")
    values: list[Any] = []

    async def ask() -> None:
        timer.cancel()
        await client.set_parameters([Parameter("speed", value=4.0)])
        values.append((await client.get_parameters(["speed"]))[0].value)

    timer = server.create_timer(0, ask)
    await until(lambda: values == [4.0])
