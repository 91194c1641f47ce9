"""What nodes tell about themselves: their panel, parameters, and states."""

from __future__ import annotations

import asyncio
import os
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.interfaces.callboard_interfaces.srv import GetDiagnostics
from actors.interfaces.std_msgs.msg import String
from actors.parameters.types import FloatingPointRange, Parameter, ParameterDescriptor
from actors.web.options import WebOptions
from tests.actors.meeting import BARE, DEADLINE_SEC
from tests.actors.web.site import Page, Site

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

    from actors import LifecycleState, TransitionCallbackReturn
    from tests.actors.meeting import Meeting

FULL: dict[str, Any] = {"start_parameter_services": True, "start_diagnostics_service": True}


class Managed(actors.LifecycleNode):
    """A node that fails to clean up."""

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        return actors.TransitionCallbackReturn.FAILURE


@pytest.fixture
async def control(meeting: Meeting) -> AsyncIterator[Site]:
    """A web server that allows control, and a client with its token."""
    async with AsyncExitStack() as stack:
        site = Site(stack, meeting, WebOptions(port=0, allow_control=True))
        await site.open()
        site.client.headers["Authorization"] = f"Bearer {site.server.token}"
        yield site


async def driver(meeting: Meeting) -> actors.Node:
    """Return a node with parameters."""
    node = await meeting.node("driver", **FULL)
    speed = ParameterDescriptor(
        description="How fast", floating_point_range=[FloatingPointRange(from_value=0.0, to_value=5.0)]
    )
    node.declare_parameter("speed", 1.5, speed)
    node.declare_parameter("frame", "map", ParameterDescriptor(read_only=True))
    node.declare_parameter("big", 2**60)
    node.declare_parameter("data", b"\x01\x02")
    return node


async def known(site: Site, name: str) -> None:
    """Wait until the server knows a node."""
    await site.json_until("/api/nodes", lambda found: name in [each["name"] for each in found])


class NodePage:
    """The document of a node's panel.

    Args:
        page: Has the connection.
    """

    def __init__(self, page: Page) -> None:
        self._page = page
        self.document: dict[str, Any] = {}

    async def until(self, fits: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """Return the document as soon as it fits."""
        while not (self.document and fits(self.document)):
            _apply(self.document, (await self._page.next())["patch"])
        return self.document


def _apply(target: dict[str, Any], patch: dict[str, Any]) -> None:
    for key, value in patch.items():
        if value is None:
            target.pop(key, None)
        elif isinstance(value, dict):
            _apply(target.setdefault(key, {}), value)  # pyright: ignore[reportUnknownArgumentType]
        else:
            target[key] = value


@pytest.fixture
async def shown(site: Site) -> AsyncIterator[NodePage]:
    """A page that shows the node `/driver`."""
    async with site.client.ws_connect("/api/live") as socket:
        page = Page(socket)
        await page.open(1, "node", node="/driver")
        yield NodePage(page)


async def test_the_panel_shows_what_a_node_tells(shown: NodePage, meeting: Meeting) -> None:
    """Its endpoints with QoS, its link, its process and its parameters; the node came after the page."""
    assert not (await shown.until(lambda _: True))["exists"]
    node = await driver(meeting)
    node.create_publisher(String, "chatter", 3)
    found = await shown.until(lambda each: "parameters" in each and "diagnostics" in each and each["links"])
    assert found["exists"]
    (chatter,) = (each for each in found["endpoints"].values() if each["name"] == "/chatter")
    assert (chatter["kind"], chatter["type"], chatter["qos"]["depth"]) == (
        "publisher", "std_msgs/msg/String", 3,
    )  # fmt: skip
    assert [each["state"] for each in found["links"].values()] == ["linked"]
    assert found["diagnostics"]["pid"] == os.getpid()
    assert "lifecycle" not in found


async def test_the_panel_shows_parameters_and_their_changes(shown: NodePage, meeting: Meeting) -> None:
    """Whoever changes them; an integer that JavaScript cannot hold is a text."""
    node = await driver(meeting)
    found = await shown.until(lambda each: "speed" in each.get("parameters", {}).get("by_name", {}))
    parameters = found["parameters"]["by_name"]
    assert parameters["speed"] == {
        "name": "speed", "type": "double", "value": 1.5, "description": "How fast",
        "additional_constraints": "", "read_only": False, "dynamic_typing": False,
        "range": {"from_value": 0.0, "to_value": 5.0, "step": 0.0},
    }  # fmt: skip
    assert parameters["frame"]["read_only"]
    assert parameters["big"]["value"] == str(2**60)
    assert parameters["data"]["value"] == [1, 2]
    node.set_parameters([Parameter("speed", value=2.5)])
    await shown.until(lambda each: each["parameters"]["by_name"]["speed"]["value"] == 2.5)


async def test_the_panel_lacks_what_a_node_does_not_tell(shown: NodePage, meeting: Meeting) -> None:
    """A node of another implementation has its endpoints all the same."""
    node = await meeting.node("driver", **BARE)
    node.create_publisher(String, "chatter", 3)
    found = await shown.until(lambda each: each["endpoints"])
    assert not {"diagnostics", "lifecycle", "parameters"} & found.keys()


async def test_the_panel_follows_a_nodes_state(shown: NodePage, meeting: Meeting) -> None:
    """With the transitions that are possible then."""
    async with Managed("driver", url=meeting.url, **BARE) as node:
        found = await shown.until(lambda each: "lifecycle" in each)
        assert found["lifecycle"]["state"] == {"label": "unconfigured", "id": 1}
        await node.trigger_configure()
        found = await shown.until(lambda each: each["lifecycle"]["state"]["label"] == "inactive")
        assert {each["label"] for each in found["lifecycle"]["transitions"]} == {
            "cleanup", "activate", "shutdown",
        }  # fmt: skip
    await shown.until(lambda each: not each["exists"] and "lifecycle" not in each)


async def test_the_panel_knows_the_parameters_of_a_node_that_was_started_again(
    shown: NodePage, meeting: Meeting
) -> None:
    """Its new ones, not those of its predecessor."""
    old = await driver(meeting)
    await shown.until(lambda each: "parameters" in each)
    await old.__aexit__(None, None, None)
    new = await meeting.node("driver", **FULL)
    new.declare_parameter("height", 3)
    await shown.until(lambda each: "height" in each.get("parameters", {}).get("by_name", {}))


async def test_parameters_are_read(control: Site, meeting: Meeting) -> None:
    """All of a node, with their descriptions."""
    await driver(meeting)
    await known(control, "/driver")
    found = await control.json("/api/nodes/driver/parameters")
    assert found["omitted"] == 0
    assert [each["name"] for each in found["parameters"]] == [
        "big", "data", "frame", "speed", "start_type_description_service", "use_sim_time",
    ]  # fmt: skip


async def set_parameters(control: Site, *parameters: dict[str, Any], status: int = 200, **more: Any) -> Any:
    """Set parameters of `/driver`."""
    body = {"parameters": parameters, **more}
    return await control.json("/api/nodes/driver/parameters", status, "PATCH", json=body)


async def test_parameters_are_set_one_by_one(control: Site, meeting: Meeting) -> None:
    """Each has its own result; a whole number becomes a double where the node has one."""
    node = await driver(meeting)
    await known(control, "/driver")
    results = await set_parameters(
        control,
        {"name": "speed", "value": 2},
        {"name": "frame", "value": "odom"},
        {"name": "big", "value": str(2**61 + 1), "type": "integer"},
        {"name": "data", "value": [3, 255]},
    )
    assert [(each["name"], each["successful"]) for each in results] == [
        ("speed", True), ("frame", False), ("big", True), ("data", True),
    ]  # fmt: skip
    assert "read-only" in results[1]["reason"]
    values = [node.get_parameter(name).value for name in ("speed", "frame", "big", "data")]
    assert values == [2.0, "map", 2**61 + 1, b"\x03\xff"]


async def test_parameters_are_set_together_or_not_at_all(control: Site, meeting: Meeting) -> None:
    """One that is out of range keeps the other back."""
    node = await driver(meeting)
    await known(control, "/driver")
    wanted = [{"name": "big", "value": 1}, {"name": "speed", "value": 7.5}]
    result = await set_parameters(control, *wanted, atomic=True)
    assert not result["successful"]
    assert result["reason"] == "Parameter speed out of range Min: 0.0, Max: 5.0, value: 7.5"
    assert node.get_parameter("big").value == 2**60
    assert await set_parameters(control, wanted[0], atomic=True) == {"successful": True, "reason": ""}


@pytest.mark.parametrize(
    ("parameter", "error"),
    [
        ({"name": "speed", "value": "fast"}, "'speed': this is not a value of type double"),
        ({"name": "big", "value": 1.5}, "'big': this is not a value of type integer"),
        ({"name": "big", "value": True}, "'big': this is not a value of type integer"),
        ({"name": "data", "value": [256]}, "'data': this is not a value of type byte array"),
        ({"name": "new", "value": {}}, "'new': this is not a value that a parameter can have"),
        ({"name": "speed", "value": 1, "type": "float"}, "There is no type 'float'"),
        ({"name": "speed"}, "value"),
        ({"name": "speed", "value": 1, "kind": 3}, "kind"),
    ],
)
async def test_a_wrong_value_is_refused(
    control: Site, meeting: Meeting, parameter: dict[str, Any], error: str
) -> None:
    """Before the node is asked; the error names the parameter."""
    await driver(meeting)
    await known(control, "/driver")
    assert error in (await set_parameters(control, parameter, status=400))["error"]


async def test_setting_needs_the_permission(site: Site, meeting: Meeting) -> None:
    """A server without `--allow-control` sets nothing."""
    await driver(meeting)
    await known(site, "/driver")
    await set_parameters(site, {"name": "speed", "value": 2}, status=403)
    await site.json("/api/nodes/driver/lifecycle", 403, "POST", json={"transition": "configure"})


@pytest.mark.parametrize("area", ["parameters", "lifecycle"])
async def test_a_node_that_does_not_serve_it_is_503_an_unknown_one_404(
    control: Site, meeting: Meeting, area: str
) -> None:
    """Each says so."""
    await meeting.node("plain", **BARE)
    await known(control, "/plain")
    assert "error" in await control.json(f"/api/nodes/plain/{area}", 503)
    assert "/nowhere" in (await control.json(f"/api/nodes/nowhere/{area}", 404))["error"]


async def test_a_transition_is_requested(control: Site, meeting: Meeting) -> None:
    """By its label or number; the answer has the state, also after one that fails."""
    path = "/api/nodes/driver/lifecycle"
    async with Managed("driver", url=meeting.url, **BARE):
        await known(control, "/driver")
        found = await control.json(path, 200, "POST", json={"transition": "configure"})
        assert (found["success"], found["state"]["label"]) == (True, "inactive")
        found = await control.json(path, 200, "POST", json={"transition": 2})
        assert (found["success"], found["state"]["label"]) == (False, "inactive")
        error = (await control.json(path, 400, "POST", json={"transition": "configure"}))["error"]
        assert "cleanup, activate, shutdown" in error


async def test_pages_share_what_is_asked_and_the_last_one_ends_it(site: Site, meeting: Meeting) -> None:
    """Two panels of a node cause one subscription; without a panel there is none."""
    node = await driver(meeting)
    async with site.client.ws_connect("/api/live") as socket:
        page = Page(socket)
        for number in (1, 2):
            await page.open(number, "node", node="/driver")
        await page.until(lambda body: body["id"] == 2 and "parameters" in body["patch"])
        assert await node.count_subscribers("/parameter_events") == 1
        await socket.send_json({"close": 1})
        await socket.send_json({"close": 2})
        async with asyncio.timeout(DEADLINE_SEC):
            while await node.count_subscribers("/parameter_events"):
                pass


async def test_a_node_that_does_not_answer_is_an_error_of_the_part(shown: NodePage, meeting: Meeting) -> None:
    """The others are shown all the same."""

    def fail(_: GetDiagnostics.Request) -> GetDiagnostics.Response:
        raise OSError("broken")

    node = await meeting.node("driver", start_parameter_services=True)
    node.create_service(GetDiagnostics, "~/get_diagnostics", fail)
    found = await shown.until(lambda each: "parameters" in each and each.get("errors"))
    assert found["errors"] == {"diagnostics": "Service '/driver/get_diagnostics' failed: OSError: broken"}
    assert "diagnostics" not in found


async def test_labels_are_in_every_document_of_a_node(control: Site, meeting: Meeting) -> None:
    """In the lists, those of one node and of one topic, the drawing, the overview, and what the page gets."""
    owner = await meeting.node("owner")
    bare = owner.create_bare_node("mirror", labels={"origin": "ros2/7"})
    bare.create_publisher(String, "/news")
    labels = {"origin": "ros2/7"}
    await known(control, "/mirror")
    topic = await control.json_found("/api/topics/news")
    assert topic["publishers"][0]["node_labels"] == labels
    assert await control.json("/api/nodes") == [{"name": "/mirror", "labels": labels}, {"name": "/owner"}]
    assert (await control.json("/api/nodes/mirror"))["labels"] == labels
    assert (await control.json("/api/graph"))["nodes"][0] == {"name": "/mirror", "labels": labels}
    rows = (await control.json("/api/overview"))["nodes"]
    assert {row["name"]: row["labels"] for row in rows} == {"/mirror": labels, "/owner": {}}
    async with control.client.ws_connect("/api/live") as socket:
        page = Page(socket)
        await page.open(1, "node", node="/mirror")
        assert (await page.until(lambda body: "labels" in body["patch"]))["patch"]["labels"] == labels
        await page.open(2, "graph")
        found = await page.until(lambda body: "node /mirror" in body["patch"].get("vertices", {}))
        assert found["patch"]["vertices"]["node /mirror"]["labels"] == labels
