"""`callboard service echo`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors import ServiceIntrospectionState
from actors.interfaces.example_interfaces.srv import AddTwoInts

if TYPE_CHECKING:
    from tests.actors.cli.conftest import Desk, Ended

LATCHED = actors.QoSProfile(depth=10, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)
PATIENCE = ("--timeout", "3")


def told(node: actors.Node, state: ServiceIntrospectionState, srv_type: Any = AddTwoInts) -> Any:
    """Make a service and a client of it that tell of their calls, latched; return the client."""
    service = node.create_service(srv_type, "add", lambda request, response: response)
    client = node.create_client(srv_type, "add")
    for end in (service, client):
        end.configure_introspection(node.get_clock(), LATCHED, state)
    return client


async def echoed(
    desk: Desk, *options: str, state: ServiceIntrospectionState = ServiceIntrospectionState.CONTENTS
) -> Ended:
    """Call once, told of latched; return what an echo prints until its timeout."""
    async with desk.node() as node:
        client = told(node, state)
        await client.wait_for_service(20)
        await client.call(AddTwoInts.Request(a=1, b=2))
        await node.get_graph()
        return await desk.callboard("service", "echo", "add", *options, *PATIENCE)


async def test_a_call_has_four_events(desk: Desk) -> None:
    """Each named as in ROS 2, with what was said."""
    events = (await echoed(desk, "--json")).documents
    assert sorted(event["info"]["event_type"] for event in events) == [
        "REQUEST_RECEIVED",
        "REQUEST_SENT",
        "RESPONSE_RECEIVED",
        "RESPONSE_SENT",
    ]
    assert {event["info"]["sequence_number"] for event in events} == {1}
    assert [event["request"] for event in events if event["request"]] == [[{"a": 1, "b": 2}]] * 2
    assert [event["response"] for event in events if event["response"]] == [[{"sum": 0}]] * 2


async def test_metadata_has_empty_lists(desk: Desk) -> None:
    """Four events that say nothing of the contents."""
    events = (await echoed(desk, "--json", state=ServiceIntrospectionState.METADATA)).documents
    assert [(event["request"], event["response"]) for event in events] == [([], [])] * 4


async def test_an_event_is_yaml(desk: Desk) -> None:
    """As in ROS 2; --once is one event."""
    ended = await echoed(desk, "--once", "--no-arr")
    assert (ended.code, ended.err) == (0, "")
    assert ended.out.startswith("info:\n  event_type: RE")
    assert "  client_gid: <sequence type: uint8, length: 16>\n" in ended.out.replace("'", "")
    assert ended.out.endswith("---\n")


@pytest.mark.parametrize("options", [("--csv",), ("--flow-style",)])
async def test_an_event_in_other_forms(desk: Desk, options: tuple[str, ...]) -> None:
    """An event a line."""
    ended = await echoed(desk, *options)
    lines = [line for line in ended.out.splitlines() if line != "---"]
    assert len(lines) == 4
    assert all("RE" in line for line in lines)


async def test_events_of_an_unknown_type(desk: Desk) -> None:
    """They describe themselves."""

    class Stranger(actors.Service, type_name="far_away/srv/Far"):
        class Request(actors.Message):
            pass

        class Response(actors.Message):
            pass

    async with desk.node() as node:
        client = told(node, ServiceIntrospectionState.METADATA, Stranger)
        await client.wait_for_service(20)
        await client.call(client.srv_type.Request())
        await node.get_graph()
        ended = await desk.callboard("service", "echo", "add", "--json", *PATIENCE)
    assert "REQUEST_SENT" in {event["info"]["event_type"] for event in ended.documents}


async def test_a_service_that_does_not_tell(desk: Desk) -> None:
    """A warning says what turns it on; the echo waits for that."""
    async with desk.node() as node:
        service = node.create_service(AddTwoInts, "add", lambda request, response: response)
        await node.get_graph()
        quiet = await desk.callboard("service", "echo", "add", *PATIENCE)
        echo = desk.start("service", "echo", "add", "example_interfaces/srv/AddTwoInts", "--once", "--json")
        service.configure_introspection(node.get_clock(), LATCHED, ServiceIntrospectionState.METADATA)
        client = node.create_client(AddTwoInts, "add")
        await client.call(AddTwoInts.Request())
        assert (await echo).json["info"]["event_type"] == "REQUEST_RECEIVED"
    assert quiet.code == 124
    assert quiet.err.startswith("WARNING: no client or server of /add publishes its calls yet")
    assert "configure_introspection" in quiet.err


async def test_a_service_that_nobody_has(desk: Desk) -> None:
    """An error without a type, and what may be meant; a warning with one."""
    async with desk.node() as node:
        node.create_service(AddTwoInts, "add", lambda request, response: response)
        await node.get_graph()
        unknown = await desk.callboard("service", "echo", "ad")
        far = await desk.callboard("service", "echo", "something_else")
        typed = await desk.callboard("service", "echo", "ad", "example_interfaces/srv/AddTwoInts", *PATIENCE)
    assert (unknown.code, unknown.out, typed.code) == (1, "", 124)
    assert unknown.err == (
        "Could not determine the type for the passed service: nobody has '/ad'; did you mean '/add'?\n"
    )
    assert far.err.endswith("to wait for it, name its type: callboard service echo /something_else TYPE\n")
    assert typed.err.startswith("WARNING: service [/ad] is not there yet; did you mean '/add'?\n")


async def test_a_message_type_is_no_service_type(desk: Desk) -> None:
    """As `service call` says it."""
    ended = await desk.callboard("service", "echo", "add", "std_msgs/msg/String")
    assert (ended.code, ended.out) == (1, "")
    assert "is not a service type" in ended.err
