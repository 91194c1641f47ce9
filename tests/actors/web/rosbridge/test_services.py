"""Services that clients of rosbridge call and serve."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

from actors.errors import RemoteError, ServiceUnavailable
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_srvs.srv import SetBool
from actors.web import worker
from actors.web.rosbridge import services, session
from proto.wire.codes import EntryKind
from tests.actors.meeting import until

if TYPE_CHECKING:
    import actors
    from actors.endpoints.client.client import Client
    from tests.actors.meeting import Meeting
    from tests.actors.web.rosbridge.bridge import Bridge, RosbridgeClient


async def adder(meeting: Meeting, **options: Any) -> actors.Node:
    """Return a node that adds; 13 is an error."""
    node = await meeting.node("adder", **options)

    def add(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        if request.a == 13:
            raise ValueError("an unlucky number")
        response.sum = request.a + request.b
        return response

    node.create_service(AddTwoInts, "/add", add)
    return node


async def _caller(meeting: Meeting, service: str = "/set") -> Client[Any, Any]:
    """Return another node's client of a service that a client of rosbridge serves."""
    node = await meeting.node("caller")
    client = node.create_client(SetBool, service)
    assert await client.wait_for_service()
    return client


async def _server(bridge: Bridge, service: str = "/set") -> RosbridgeClient:
    """Return a client of rosbridge that serves a service."""
    client = await bridge.connect()
    await client.send("advertise_service", service=service, type="std_srvs/SetBool")
    return client


async def test_calls(bridge: Bridge, meeting: Meeting) -> None:
    """With arguments by name and in order; the response has the text and the id of the call."""
    await adder(meeting)
    client = await bridge.connect()
    for args in ({"a": 5, "b": 3}, [5, 3]):
        assert await client.call("add", args) == {
            "op": "service_response", "id": "call:add", "service": "add", "values": {"sum": 8}, "result": True
        }  # fmt: skip


@pytest.mark.parametrize(
    ("service", "args", "text"),
    [
        ("/add", {"a": 13}, "unlucky"),
        ("/add", {"a": "five"}, "AddTwoInts_Request.a"),
        ("/add", [1, 2, 3], "has 2 fields"),
        ("/nothing", {}, "'/nothing' has no server"),
        ("/not a name", {}, "has no server"),
    ],
)
async def test_a_call_that_fails_says_why(
    bridge: Bridge, meeting: Meeting, service: str, args: Any, text: str
) -> None:
    """In its response, and the client goes on."""
    await adder(meeting)
    client = await bridge.connect()
    response = await client.call(service, args)
    assert response["result"] is False
    assert text in response["values"]
    assert (await client.values("/add", {"a": 1, "b": 1})) == {"sum": 2}


async def test_a_slow_service_holds_up_nothing(bridge: Bridge, meeting: Meeting) -> None:
    """Calls after it are answered before it; with a timeout it ends."""
    node = await adder(meeting)
    release = asyncio.Event()

    async def wait(_: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        await release.wait()
        return response

    node.create_service(SetBool, "/slow", wait, concurrent=True)
    client = await bridge.connect()
    await client.send("call_service", id="slow", service="/slow")
    await client.send("call_service", id="impatient", service="/slow", timeout=0.01)
    assert (await client.values("/add", {"a": 1, "b": 1})) == {"sum": 2}
    impatient = await client.until(lambda found: found.get("id") == "impatient")
    assert impatient["result"] is False
    release.set()
    assert (await client.next())["id"] == "slow"


async def test_calls_that_wait_are_limited(
    bridge: Bridge, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A client that sends more of them gets errors."""
    monkeypatch.setattr(session, "MAX_TASKS", 1)
    node = await adder(meeting)
    release = asyncio.Event()

    async def wait(_: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        await release.wait()
        return response

    node.create_service(SetBool, "/slow", wait, concurrent=True)
    client = await bridge.connect()
    await client.send("call_service", id="first", service="/slow")
    await client.send("call_service", id="second", service="/slow")
    response = await client.next()
    assert (response["id"], response["result"]) == ("second", False)
    assert "wait already" in response["values"]
    release.set()
    assert (await client.next())["id"] == "first"


async def test_clients_of_services_are_kept_and_make_room(
    bridge: Bridge, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A second call needs no new one; the one used least recently goes."""
    monkeypatch.setattr(services, "MAX_CLIENTS", 1)
    node = await adder(meeting)
    node.create_service(AddTwoInts, "/other", lambda _request, response: response)
    client = await bridge.connect()
    for service in ("/add", "/add", "/other", "/add"):
        await client.values(service, {})
    graph = await node.get_graph()
    assert sum(each.node == "/rosbridge_websocket" for each in graph.of_kind(EntryKind.CLIENT)) == 1


async def test_a_client_serves(bridge: Bridge, meeting: Meeting) -> None:
    """A node gets the values of its response, whatever the result is: many programs return false."""
    server = await _server(bridge)
    client = await _caller(meeting)
    for result in (True, False):
        call = client.call_async(SetBool.Request(data=True))
        request = await server.next()
        assert (request["op"], request["service"], request["args"]) == (
            "call_service",
            "/set",
            {"data": True},
        )
        values = {"success": True, "message": "done"}
        await server.send("service_response", id=request["id"], service="/set", values=values, result=result)
        response = await call
        assert (response.success, response.message) == (True, "done")


@pytest.mark.parametrize(
    ("values", "text"),
    [("It is broken", "It is broken"), (None, "has failed"), ({"color": 1}, "has no field 'color'")],
)
async def test_a_request_that_fails(bridge: Bridge, meeting: Meeting, values: Any, text: str) -> None:
    """Fails at its caller, with the text of the client."""
    server = await _server(bridge)
    client = await _caller(meeting)
    call = client.call_async(SetBool.Request())
    request = await server.next()
    await server.send("service_response", id=request["id"], service="/set", values=values, result=False)
    with pytest.raises(RemoteError, match=text):
        await call


async def test_calls_of_a_client_that_leaves_fail(bridge: Bridge, meeting: Meeting) -> None:
    """At once; so do those of a service that it serves no longer."""
    server = await _server(bridge)
    client = await _caller(meeting)
    call = client.call_async(SetBool.Request())
    await server.next()
    await server.send("unadvertise_service", service="/set")
    with pytest.raises(ServiceUnavailable):
        await call
    await server.send("advertise_service", service="/set", type="std_srvs/srv/SetBool")
    assert await client.wait_for_service()
    call = client.call_async(SetBool.Request())
    await server.next()
    await server.socket.close()
    with pytest.raises(ServiceUnavailable):
        await call
    await until(lambda: not client.service_is_ready())


async def test_responses_without_requests_are_errors(bridge: Bridge) -> None:
    """Of a service that the client serves, or does not serve."""
    client = await _server(bridge)
    for service in ("/set", "/other"):
        await client.send("service_response", id="x", service=service, values={}, result=True)
        status = await client.next()
        assert (status["op"], status["id"]) == ("status", "x")
        assert "no request" in status["msg"]
    await client.send("unadvertise_service", service="/other")
    assert "has not advertised" in (await client.next())["msg"]
    await client.send("advertise_service", service="/a", type="std_msgs/String")
    assert "std_msgs" in (await client.next())["msg"]


async def test_clients_call_each_other(bridge: Bridge) -> None:
    """Through the graph."""
    server, client = await _server(bridge), await bridge.connect()
    await server.settled()
    await client.send("call_service", id=1, service="/set", args={"data": True})
    request = await server.next()
    await server.send(
        "service_response", id=request["id"], service="/set", values={"message": "x"}, result=True
    )
    assert (await client.next())["values"] == {"success": False, "message": "x"}


async def test_calls_that_are_first_at_the_same_time_leave_one_client(
    bridge: Bridge, meeting: Meeting
) -> None:
    """Each makes one of its own; those that are not kept end with their calls."""
    began, all_began = 0, asyncio.Event()

    async def answer(_: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        nonlocal began
        began += 1
        if began == 5:
            all_began.set()
        await all_began.wait()
        return response

    (await meeting.node("setter")).create_service(SetBool, "/set", answer, concurrent=True)
    client = await bridge.connect()
    await until(lambda: bridge.observer.snapshot.count(EntryKind.SERVICE, "/set"))
    for number in range(5):
        await client.send("call_service", id=number, service="/set")
    assert {(await client.next())["id"] for _ in range(5)} == set(range(5))
    graph = await bridge.observer.node.get_graph()
    assert sum(each.name == "/set" for each in graph.of_kind(EntryKind.CLIENT)) == 1


async def test_a_response_is_sent_as_it_is_if_the_thread_has_no_room(
    bridge: Bridge, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Instead of a PNG file; its client reads it, too."""
    client = await bridge.connect()
    monkeypatch.setattr(worker, "MAX_WAITING", 0)
    await client.send("call_service", id=1, service="/add", args=[1], compression="png")
    assert (await client.next())["op"] == "service_response"
