"""`~/get_type_description`: what a node says about the types that it uses."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.convert import message_to_ordereddict
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.message import definition, type_hash, type_name
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool
from actors.interfaces.type_description_interfaces.srv import GetTypeDescription

if TYPE_CHECKING:
    import actors
    from tests.actors.meeting import Meeting

ON: dict[str, Any] = {"parameter_overrides": {}}


async def ask(
    meeting: Meeting, wanted: object, *, include_type_sources: bool = True
) -> GetTypeDescription.Response:
    """Ask the node `/ns/server`."""
    node = await meeting.node("asker")
    client = node.create_client(GetTypeDescription, "/ns/server/get_type_description")
    assert await client.wait_for_service(20)
    request = GetTypeDescription.Request(
        type_name=type_name(wanted),
        type_hash=type_hash(wanted),
        include_type_sources=include_type_sources,
    )
    return await client.call(request)


def described(response: GetTypeDescription.Response) -> Any:
    """Return the description without default values, which a definition does not have."""

    def without_default(fields: dict[str, Any]) -> dict[str, Any]:
        return {name: value for name, value in fields.items() if name != "default_value"}

    text = json.dumps(message_to_ordereddict(response.type_description))
    return json.loads(text, object_hook=without_default)


async def test_a_message_type(meeting: Meeting) -> None:
    """The description that the hash is made of, and the text of each type that it refers to."""
    server = await meeting.node("server", namespace="ns", **ON)
    server.create_publisher(PoseStamped, "pose")
    response = await ask(meeting, PoseStamped)
    assert response.successful, response.failure_reason
    assert described(response) == json.loads(definition(PoseStamped))
    texts = {each.type_name: each for each in response.type_sources}
    assert next(iter(texts)) == "geometry_msgs/msg/PoseStamped"
    assert texts["geometry_msgs/msg/PoseStamped"].encoding == "msg"
    assert "geometry_msgs/Pose pose\n" in texts["geometry_msgs/msg/PoseStamped"].raw_file_contents
    assert "geometry_msgs/msg/Quaternion" in texts


async def test_a_service_type(meeting: Meeting) -> None:
    """With a service's text; the types that ROS derives from it are implicit."""
    server = await meeting.node("server", namespace="ns", **ON)
    server.create_client(SetBool, "set")
    response = await ask(meeting, SetBool)
    texts = {each.type_name: each for each in response.type_sources}
    assert texts["std_srvs/srv/SetBool"].encoding == "srv"
    assert "---" in texts["std_srvs/srv/SetBool"].raw_file_contents
    event = texts["std_srvs/srv/SetBool_Event"]
    assert (event.encoding, event.raw_file_contents) == ("implicit", "")


async def test_without_sources(meeting: Meeting) -> None:
    """Sources are left out if they are not wanted."""
    server = await meeting.node("server", namespace="ns", **ON)
    server.create_subscription(String, "text", lambda _: None)
    response = await ask(meeting, String, include_type_sources=False)
    assert (response.successful, response.type_sources) == (True, [])


async def test_a_type_that_the_node_does_not_use(meeting: Meeting) -> None:
    """A type that the node does not use is not described; the reason has rcl's text."""
    server = await meeting.node("server", namespace="ns", **ON)
    server.create_publisher(String, "text").destroy()
    response = await ask(meeting, String)
    assert (response.successful, response.failure_reason) == (
        False,
        "Type not currently in use by this node",
    )


@pytest.mark.parametrize("enabled", [True, False])
async def test_the_parameter(meeting: Meeting, enabled: bool) -> None:
    """`start_type_description_service` says whether a node has the service."""
    node: actors.Node = await meeting.node(
        "server", parameter_overrides={"start_type_description_service": enabled}
    )
    names = [name for name, _ in await node.get_service_names_and_types()]
    assert names == (["/server/get_type_description"] if enabled else [])
