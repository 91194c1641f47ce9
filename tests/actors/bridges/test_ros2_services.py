"""Calls that cross the bridge: callboard's own nodes on one side, a stand-in for ROS 2 on the other."""

from __future__ import annotations

import asyncio
from collections import Counter
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest

import actors
from actors.bridges.counters import Counts
from actors.bridges.plan import Mirror
from actors.bridges.request_window import MAX_IN_FLIGHT, MAX_WAITING
from actors.bridges.ros2 import inbound_calls, outbound_calls, services
from actors.bridges.ros2.errors import RosError, UnknownTypeError
from actors.bridges.ros2.inbound_calls import InboundCalls
from actors.bridges.ros2.outbound_calls import OutboundCalls
from actors.bridges.ros2.types import TypePair
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.interfaces.codec import codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.message import type_name
from actors.interfaces.rcl_interfaces.srv import ListParameters
from proto.wire.codes import EntryKind
from tests.actors.meeting import until

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.actors.meeting import Meeting

ACTION = "/work/_action"
TYPES: dict[str, Any] = {
    "/add": AddTwoInts,
    f"{ACTION}/send_goal": Fibonacci.Impl.SendGoalService,
    f"{ACTION}/get_result": Fibonacci.Impl.GetResultService,
    f"{ACTION}/cancel_goal": CancelGoal,
    "/list_parameters": ListParameters,
}
FEEDBACK = Fibonacci.Impl.FeedbackMessage
REFUSED = 1313
"""A number that ROS 2 cannot have, here."""


class OneType(NamedTuple):
    """A message type whose objects in ROS 2 are callboard's own."""

    ours: Any
    theirs: Any

    def to_object(self, data: bytes) -> Any:
        message = codec_for(self.ours).decode(data)
        if REFUSED in (getattr(message, "a", None), getattr(message, "sum", None)):
            raise InvalidMessageError("AddTwoInts: 1313 is refused")
        return message

    def from_object(self, message: Any) -> bytes:
        if getattr(message, "sum", None) == REFUSED:
            raise InvalidMessageError("AddTwoInts: 1313 is refused")
        return bytes(codec_for(self.ours).encode(message))


class ServiceTypes(NamedTuple):
    ours: Any
    theirs: Any
    request: OneType
    response: OneType


class Types:
    """All types are on both sides."""

    def service(self, name: str) -> ServiceTypes:
        found = next(each for each in TYPES.values() if type_name(each) == name)
        request, response = OneType(found.Request, found.Request), OneType(found.Response, found.Response)
        return ServiceTypes(found, found, request, response)

    def known(self, name: str) -> TypePair:
        return TypePair(name, "srv", our_request_hash="RIHS01_1")


class RosClient:
    """A client in ROS 2: the test answers."""

    def __init__(self, node: RosNode, callback: Callable[[int, Any], None]) -> None:
        self._node = node
        self._callback = callback
        self.sent: list[Any] = []
        self.destroyed = False

    def is_ready(self) -> bool:
        return bool(self._node.gids)

    def send(self, request: Any) -> int:
        if self._node.refuses:
            raise RosError("ROS 2 refuses a request: no memory")
        self.sent.append(request)
        return len(self.sent)

    def answer(self, number: int) -> None:
        """Answer the request with this number, from 1."""
        request = self.sent[number - 1]
        self.respond(number, AddTwoInts.Response(sum=request.a + request.b))

    def respond(self, number: int, response: Any) -> None:
        self._callback(number, response)

    def destroy(self) -> None:
        self.destroyed = True


class RosService:
    """A service in ROS 2: the test calls."""

    def __init__(self, callback: Callable[[Any, Any], None]) -> None:
        self.ask = callback
        self.responses: dict[Any, Any] = {}
        self.refuses = self.destroyed = False
        self.on_response: Callable[[], object] = lambda: None

    def respond(self, response: Any, header: Any) -> None:
        assert not self.destroyed
        if self.refuses:
            raise RosError("ROS 2 refuses a response: no memory")
        self.responses[header] = response
        self.on_response()

    def has(self, header: Any) -> bool:
        """Return whether the request has its response."""
        return header in self.responses

    def destroy(self) -> None:
        self.destroyed = True


class RosNode:
    """A node in ROS 2, where the service has these servers."""

    def __init__(self) -> None:
        self.gids = {b"first"}
        self.refuses = False
        self.clients: list[RosClient] = []
        self.services: list[RosService] = []

    @property
    def client(self) -> RosClient:
        return self.clients[-1]

    def create_client(
        self, kind: Any, name: str, callback: Callable[[int, Any], None], *, qos: Any
    ) -> RosClient:
        del kind, name
        assert qos is services.SERVICE_QOS
        self.clients.append(RosClient(self, callback))
        return self.client

    def create_service(
        self, kind: Any, name: str, callback: Callable[[Any, Any], None], *, qos: Any
    ) -> RosService:
        del kind, name
        assert qos is services.SERVICE_QOS
        self.services.append(RosService(callback))
        return self.services[-1]

    def servers(self, name: str) -> frozenset[bytes]:
        del name
        return frozenset(self.gids)


class CallCounts(Counts):
    """The counts of a service."""

    of = ""
    """Its name."""

    @property
    def all(self) -> Counter[str]:
        """What has been counted."""
        return +Counter({"received": self.received, "sent": self.sent, **self.dropped})


def mirror(name: str = "/add", node: str = "/there") -> Mirror:
    return Mirror(node, EntryKind.SERVICE, name, type_name(TYPES[name]), None, name, node)


class FeedbackFromRos:
    """The topic with an action's feedback, from ROS 2."""

    def __init__(self, publisher: actors.Publisher[Any]) -> None:
        self._publisher = publisher
        self.arrived: list[Any] = []
        self.heard = False

    def is_connected(self) -> bool:
        return self.heard

    def receive_now(self) -> None:
        for each in self.arrived:
            self._publisher.publish(each)
        self.arrived.clear()

    def publisher_on(self, node: str) -> actors.Publisher[Any]:
        assert node == "/there"
        return self._publisher


class FeedbackFromHere(NamedTuple):
    """The topic with an action's feedback, from callboard."""

    subscription: actors.Subscription[Any]


class Sides:
    """A node here, which calls or serves, and the bridge's with what it carries."""

    def __init__(self, own: actors.Node, bridge: actors.Node) -> None:
        self.own = own
        self.bare = bridge.create_bare_node("there")
        self.ros = RosNode()
        self.counts = CallCounts()
        self.warnings: list[str] = []
        types: Any = Types()
        ros: Any = self.ros
        self.feedback: Any = None
        """The topic with the feedback of the action."""
        self.request_hash = ""
        self.outbound = OutboundCalls(ros, types, self.count, self.topic, lambda _: self.request_hash)
        self.inbound = InboundCalls(self.bare, types, self.count, self.warn, self.topic)

    def warn(self, kind: str, text: str) -> None:
        assert kind
        self.warnings.append(text)

    def topic(self, key: tuple[str, str]) -> Any:
        assert key == (f"{ACTION}/feedback", type_name(FEEDBACK))
        return self.feedback

    def count(self, name: str) -> Any:
        self.counts.of = name
        return self.counts

    def show_here(self, name: str = "/add") -> Mirror:
        """Show a server of ROS 2 here."""
        shown = mirror(name)
        self.outbound.show(shown, self.bare)
        return shown

    async def client(self, name: str = "/add") -> actors.Client[Any, Any]:
        """Return a client here that has found the server."""
        client = self.own.create_client(TYPES[name], name)
        await until(client.service_is_ready)
        return client

    def show_there(self, name: str = "/add", node: str = "/there") -> RosService:
        """Show a server here in ROS 2."""
        ros: Any = self.ros
        self.inbound.show(mirror(name, node), ros)
        return self.ros.services[-1]

    def close(self) -> None:
        self.outbound.close()
        self.inbound.close()


@pytest.fixture
async def sides(meeting: Meeting) -> Any:
    made = Sides(await meeting.node("own"), await meeting.node("bridge"))
    yield made
    made.close()


def numbers(requests: list[Any]) -> list[int]:
    return [each.a for each in requests]


async def test_a_server_gets_ten_requests_and_the_others_wait(sides: Sides) -> None:
    """In order, one more for each response; responses in any order reach their callers."""
    sides.show_here()
    client = await sides.client()
    calls = [client.call_async(AddTwoInts.Request(a=number, b=100)) for number in range(25)]
    await until(lambda: sides.counts.all["received"] == 25)
    ros = sides.ros.client
    assert numbers(ros.sent) == list(range(MAX_IN_FLIGHT))
    ros.answer(10)
    ros.answer(3)
    assert numbers(ros.sent) == list(range(MAX_IN_FLIGHT + 2))
    for number in [1, 2, *range(4, 10), *range(11, 26)]:
        ros.answer(number)
    assert [each.sum for each in await asyncio.gather(*calls)] == list(range(100, 125))
    assert sides.counts.all == {"received": 25, "sent": 25}
    assert (len(sides.ros.clients), sides.counts.of) == (1, "/add")


async def test_a_server_with_another_request_is_not_shown(sides: Sides) -> None:
    """The error has both hashes; one with the same hash, or with an unknown one, is shown."""
    sides.request_hash = "RIHS01_2"
    with pytest.raises(UnknownTypeError, match="RIHS01_1 in callboard and RIHS01_2 in ROS 2"):
        sides.show_here()
    sides.request_hash = "RIHS01_1"
    sides.show_here()


async def test_more_than_the_queue_takes_are_refused_at_once(sides: Sides) -> None:
    """Case 91: with the error that says so; those that wait are answered."""
    sides.show_here()
    client = await sides.client()
    most = MAX_IN_FLIGHT + MAX_WAITING
    calls = [client.call_async(AddTwoInts.Request(a=number, b=100)) for number in range(most + 3)]
    for call in calls[most:]:
        with pytest.raises(actors.ServiceOverloaded, match=f"{MAX_WAITING} requests wait already"):
            await call
    for number in range(1, most + 1):
        sides.ros.client.answer(number)
    await asyncio.gather(*calls[:most])
    assert sides.counts.all["overloaded"] == 3


async def test_a_caller_that_gives_up_frees_its_place(sides: Sides) -> None:
    """A request that waits is never sent; the response to one that was sent is dropped, and counted."""
    sides.show_here()
    client = await sides.client()
    calls = [client.call_async(AddTwoInts.Request(a=number)) for number in range(12)]
    await until(lambda: sides.counts.all["received"] == 12)
    calls[0].cancel()
    calls[10].cancel()
    await until(lambda: sides.counts.all["abandoned"] == 2)
    ros = sides.ros.client
    ros.answer(1)
    assert numbers(ros.sent) == [*range(10), 11]
    for number in range(2, 12):
        ros.answer(number)
    ros.answer(2)  # a second server of the name
    assert [each.sum for each in await asyncio.gather(*calls[1:10], calls[11])] == [*range(1, 10), 11]
    assert sides.counts.all == {"received": 12, "sent": 10, "abandoned": 2, "late": 2}


async def test_calls_end_when_the_server_leaves(sides: Sides) -> None:
    """Those in flight and those that wait, at once, as unavailable; nothing is left in ROS 2."""
    shown = sides.show_here()
    client = await sides.client()
    calls = [client.call_async(AddTwoInts.Request(a=number), None) for number in range(12)]
    await until(lambda: sides.counts.all["received"] == 12)
    sides.outbound.hide(shown)
    for call in calls:
        with pytest.raises(actors.ServiceUnavailable):
            await call
    assert sides.ros.client.destroyed
    sides.outbound.hide(shown)
    assert not await client.wait_for_service(0)


async def test_servers_of_one_name_share_their_requests(sides: Sides) -> None:
    """Two nodes here stand for them, with one client in ROS 2: each of its requests reaches both there."""
    first = sides.show_here()
    sides.outbound.show(mirror(node="/second"), sides.bare)
    client = await sides.client()
    calls = [client.call_async(AddTwoInts.Request(a=number)) for number in range(15)]
    await until(lambda: sides.counts.all["received"] == 15)
    assert len(sides.ros.client.sent) == MAX_IN_FLIGHT
    sides.outbound.hide(first)
    assert not sides.ros.client.destroyed
    ends = asyncio.gather(*calls, return_exceptions=True)
    answered = 0
    while not ends.done():
        await asyncio.sleep(0)
        while answered < len(sides.ros.client.sent):
            answered += 1
            sides.ros.client.answer(answered)
    unavailable = [each for each in await ends if isinstance(each, actors.ServiceUnavailable)]
    assert 0 < len(unavailable) < 15
    assert sides.counts.all["sent"] == 15 - len(unavailable)


async def test_requests_wait_until_the_client_has_found_the_server(sides: Sides) -> None:
    """Those that ROS 2 gets before are lost."""
    sides.ros.gids = set()
    sides.show_here()
    sides.outbound.prepare("/other")
    sides.outbound.prepare("/add")
    assert len(sides.ros.clients) == 1
    client = await sides.client()
    call = client.call_async(AddTwoInts.Request(a=1, b=2))
    await until(lambda: sides.counts.all["received"] == 1)
    assert sides.ros.client.sent == []
    sides.ros.gids = {b"first"}
    await until(lambda: len(sides.ros.client.sent) == 1)
    sides.ros.client.answer(1)
    assert (await call).sum == 3
    assert len(sides.ros.clients) == 1


async def test_a_server_that_is_never_found_is_unavailable(
    sides: Sides, monkeypatch: pytest.MonkeyPatch
) -> None:
    """ROS 2 shows it, but cannot connect; later calls try again."""
    monkeypatch.setattr(outbound_calls, "MATCH_LIMIT_SEC", 0.0)
    sides.ros.gids = set()
    sides.show_here()
    client = await sides.client()
    with pytest.raises(actors.ServiceUnavailable, match="cannot connect"):
        await client.call(AddTwoInts.Request(), None)
    sides.ros.gids = {b"first"}
    call = client.call_async(AddTwoInts.Request(a=1))
    await until(lambda: len(sides.ros.client.sent) == 1)
    sides.ros.client.answer(1)
    assert (await call).sum == 1


async def test_a_call_without_a_deadline_has_one_on_the_bridge(
    sides: Sides, monkeypatch: pytest.MonkeyPatch
) -> None:
    """ROS 2 may lose a request; the result of a goal may take as long as the goal."""
    monkeypatch.setattr(services, "CALL_LIMIT_SEC", 0.01)
    sides.show_here()
    client = await sides.client()
    with pytest.raises(actors.ServiceTimeout, match="no response in time"):
        await client.call(AddTwoInts.Request(), None)
    assert sides.counts.all["timeout"] == 1
    name = f"{ACTION}/get_result"
    sides.show_here(name)
    results = await sides.client(name)
    call = results.call_async(TYPES[name].Request(), None)
    await until(lambda: len(sides.ros.client.sent) == 1)
    with pytest.raises(actors.ServiceTimeout):
        await client.call(AddTwoInts.Request(), None)
    assert not call.done()


async def test_what_cannot_cross_fails_alone(sides: Sides) -> None:
    """A request and a response with a value that the other side cannot have; then another."""
    sides.show_here()
    client = await sides.client()
    with pytest.raises(actors.RemoteError, match="1313 is refused"):
        await client.call(AddTwoInts.Request(a=REFUSED))
    bad = client.call_async(AddTwoInts.Request(a=1, b=REFUSED - 1))
    good = client.call_async(AddTwoInts.Request(a=1, b=1))
    await until(lambda: len(sides.ros.client.sent) == 2)
    sides.ros.client.answer(1)
    sides.ros.client.answer(2)
    with pytest.raises(actors.RemoteError, match="1313 is refused"):
        await bad
    assert (await good).sum == 2
    assert sides.counts.all == {"received": 3, "sent": 1, "invalid": 2}


async def test_what_ros_2_refuses_is_unavailable(sides: Sides, monkeypatch: pytest.MonkeyPatch) -> None:
    """A request, or the client."""
    sides.show_here()
    client = await sides.client()
    sides.ros.refuses = True
    with pytest.raises(actors.ServiceUnavailable, match="no memory"):
        await client.call(AddTwoInts.Request())
    assert sides.counts.all["refused"] == 1

    def refuse(*_: object, **__: object) -> None:
        raise RosError("ROS 2 refuses a client of '/work/_action/cancel_goal'")

    monkeypatch.setattr(sides.ros, "create_client", refuse)
    name = f"{ACTION}/cancel_goal"
    sides.show_here(name)
    with pytest.raises(actors.ServiceUnavailable, match="refuses a client"):
        await (await sides.client(name)).call(CancelGoal.Request())


async def test_a_server_that_is_back_does_not_wait_for_the_dead_one(
    sides: Sides, monkeypatch: pytest.MonkeyPatch
) -> None:
    """ROS 2 shows a killed one for its lease, with all requests that it has got."""
    monkeypatch.setattr(outbound_calls, "WATCH_SEC", 0.0)
    sides.show_here()
    client = await sides.client()
    lost = [client.call_async(AddTwoInts.Request(a=number)) for number in range(MAX_IN_FLIGHT)]
    call = client.call_async(AddTwoInts.Request(a=100))
    await until(lambda: sides.counts.all["received"] == MAX_IN_FLIGHT + 1)
    assert len(sides.ros.client.sent) == MAX_IN_FLIGHT
    sides.ros.gids.add(b"second")
    await until(lambda: len(sides.ros.client.sent) == MAX_IN_FLIGHT + 1)
    sides.ros.client.answer(MAX_IN_FLIGHT + 1)
    assert (await call).sum == 100
    # Its lease has ended: what it alone had got ends, too.
    late = client.call_async(AddTwoInts.Request(a=101), None)
    await until(lambda: len(sides.ros.client.sent) == MAX_IN_FLIGHT + 2)
    sides.ros.gids.remove(b"first")
    for each in lost:
        with pytest.raises(actors.ServiceUnavailable, match="its server has left ROS 2"):
            await each
    sides.ros.client.answer(MAX_IN_FLIGHT + 2)
    assert (await late).sum == 101
    assert sides.counts.all["unavailable"] == MAX_IN_FLIGHT


async def test_a_result_that_a_dead_server_had_to_send_ends(
    sides: Sides, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another server of the name is there all the time, so that the service does not go."""
    monkeypatch.setattr(outbound_calls, "WATCH_SEC", 0.0)
    name = f"{ACTION}/get_result"
    sides.show_here(name)
    client = await sides.client(name)
    old = client.call_async(TYPES[name].Request(), None)
    await until(lambda: sides.counts.all["received"] == 1)
    sides.ros.gids = {b"first", b"second"}
    both = client.call_async(TYPES[name].Request(), None)
    await until(lambda: sides.counts.all["received"] == 2)
    sides.ros.gids = {b"second"}
    with pytest.raises(actors.ServiceUnavailable):
        await old
    sides.ros.client.respond(2, TYPES[name].Response(status=4))
    assert (await both).status == 4


async def test_a_call_from_ros_2_gets_its_response(sides: Sides) -> None:
    """A slow one does not hold up others; nothing is called twice."""
    slow = asyncio.Event()

    async def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        if request.a == 1:
            await slow.wait()
        return AddTwoInts.Response(sum=request.a + request.b)

    server = sides.own.create_service(AddTwoInts, "/add", add, concurrent=True)
    service = sides.show_there()
    for number in range(1, 4):
        service.ask(AddTwoInts.Request(a=number), number)
    await until(lambda: len(service.responses) == 2)
    assert 1 not in service.responses
    slow.set()
    await until(lambda: len(service.responses) == 3)
    assert {header: each.sum for header, each in service.responses.items()} == {1: 1, 2: 2, 3: 3}
    assert sides.counts.all == {"received": 3, "sent": 3}
    assert server.calls == 3


async def test_what_fails_here_is_counted_and_named(sides: Sides) -> None:
    """There is no response in ROS 2 for it: the handler raises, the value is refused, nobody serves."""

    def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        if request.a == 1:
            raise ValueError("no sum")
        return AddTwoInts.Response(sum=request.a + request.b)

    server = sides.own.create_service(AddTwoInts, "/add", add)
    service = sides.show_there()
    service.ask(AddTwoInts.Request(a=1), "raises")
    service.ask(AddTwoInts.Request(a=REFUSED - 1, b=1), "refused here")
    service.ask(AddTwoInts.Request(a=2), "good")
    await until(lambda: "good" in service.responses)
    await until(lambda: sides.counts.all["failed"] == 1)
    server.destroy()
    service.ask(AddTwoInts.Request(a=2), "nobody")
    await until(lambda: sides.counts.all["unavailable"] == 1)
    assert sides.counts.all == {"received": 4, "sent": 1, "failed": 1, "invalid": 1, "unavailable": 1}
    assert list(service.responses) == ["good"]
    texts = "\n".join(sides.warnings)
    assert (
        "Service '/add': a call from ROS 2 has no response: Service '/add' failed: ValueError: no sum"
        in texts
    )
    assert "1313 is refused" in texts


async def test_a_response_that_ros_2_refuses_is_counted(sides: Sides) -> None:
    """The call is over."""
    sides.own.create_service(AddTwoInts, "/add", lambda request: AddTwoInts.Response())
    service = sides.show_there()
    service.refuses = True
    service.ask(AddTwoInts.Request(), 1)
    await until(lambda: sides.counts.all["refused"] == 1)
    assert "no memory" in sides.warnings[0]


async def test_too_many_requests_from_ros_2_are_dropped(
    sides: Sides, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each frees its place when it has ended."""
    monkeypatch.setattr(inbound_calls, "MAX_PENDING", 2)
    entered = asyncio.Event()

    async def wait(request: AddTwoInts.Request) -> AddTwoInts.Response:
        await entered.wait()
        return AddTwoInts.Response(sum=request.a)

    sides.own.create_service(AddTwoInts, "/add", wait, concurrent=True)
    service = sides.show_there()
    for number in range(3):
        service.ask(AddTwoInts.Request(a=number), number)
    assert sides.counts.all["overloaded"] == 1
    entered.set()
    await until(lambda: len(service.responses) == 2)
    service.ask(AddTwoInts.Request(a=7), 7)
    await until(lambda: 7 in service.responses)
    assert 2 not in service.responses


async def test_of_several_servers_one_hands_requests_on(sides: Sides) -> None:
    """ROS 2 sends each request to all of them; another takes over when the first leaves."""
    served = sides.own.create_service(AddTwoInts, "/add", lambda request: AddTwoInts.Response(sum=request.a))
    first, second = sides.show_there(), sides.show_there(node="/second")
    for each in (first, second):
        each.ask(AddTwoInts.Request(a=1), 1)
    await until(lambda: first.responses)
    sides.inbound.hide(mirror())
    assert first.destroyed
    second.ask(AddTwoInts.Request(a=2), 2)
    await until(lambda: second.responses)
    assert (list(first.responses), list(second.responses), served.calls) == ([1], [2], 2)
    sides.inbound.hide(mirror(node="/second"))
    sides.inbound.hide(mirror(node="/second"))
    assert second.destroyed


async def test_calls_from_ros_2_are_cancelled_with_what_they_came_through(sides: Sides) -> None:
    """The handler of a call ends whose response nobody can get."""
    entered, cancelled = asyncio.Event(), asyncio.Event()

    async def wait(request: AddTwoInts.Request) -> AddTwoInts.Response:
        entered.set()
        try:
            await asyncio.Event().wait()
        finally:
            cancelled.set()
        raise AssertionError

    sides.own.create_service(AddTwoInts, "/add", wait, concurrent=True)
    service = sides.show_there()
    service.ask(AddTwoInts.Request(), 1)
    await asyncio.wait_for(entered.wait(), 30)
    sides.inbound.hide(mirror())
    await asyncio.wait_for(cancelled.wait(), 30)
    assert service.destroyed
    assert sides.counts.all == {"received": 1, "unavailable": 1}


@pytest.mark.parametrize(
    ("part", "field", "value"),
    [("send_goal", "accepted", False), ("get_result", "status", 6), ("cancel_goal", "return_code", 1)],
)
async def test_an_action_in_ros_2_hears_when_its_server_here_is_gone(
    sides: Sides, part: str, field: str, value: object
) -> None:
    """The goal is not accepted, has been aborted, or cannot be cancelled: no client waits for ever."""
    service = sides.show_there(f"{ACTION}/{part}")
    service.ask(TYPES[f"{ACTION}/{part}"].Request(), 1)
    await until(lambda: service.responses)
    assert getattr(service.responses[1], field) == value
    assert sides.counts.all == {"received": 1, "sent": 1, "unavailable": 1}


async def test_a_result_that_waits_is_aborted_when_its_server_here_leaves(sides: Sides) -> None:
    """Also when the bridge notices it before the call ends."""
    name = f"{ACTION}/get_result"

    async def wait(request: Any) -> Any:
        await asyncio.Event().wait()

    server = sides.own.create_service(TYPES[name], name, wait, concurrent=True)
    service = sides.show_there(name)
    service.ask(TYPES[name].Request(), 1)
    await until(lambda: server.pending == 1)
    sides.inbound.hide(mirror(name))
    assert service.responses[1].status == 6
    assert service.destroyed


async def test_a_goal_waits_until_its_feedback_is_heard(
    sides: Sides, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The client's subscription began before, and reaches ROS 2 by another way; without it, not for ever."""
    monkeypatch.setattr(services, "FEEDBACK_SEC", 1e6)
    name = f"{ACTION}/send_goal"
    sides.show_here(name)
    client = await sides.client(name)
    call = client.call_async(TYPES[name].Request())
    await until(lambda: sides.counts.all["received"] == 1)
    assert sides.ros.clients == []
    topic = FeedbackFromRos(sides.bare.create_publisher(FEEDBACK, f"{ACTION}/feedback", 10))
    sides.feedback, topic.heard = topic, True
    await until(lambda: len(sides.ros.clients) == 1)
    assert len(sides.ros.client.sent) == 1
    call.cancel()
    monkeypatch.setattr(services, "FEEDBACK_SEC", 0.0)
    topic.heard = False
    call = client.call_async(TYPES[name].Request())
    await until(lambda: len(sides.ros.client.sent) == 2)
    call.cancel()


async def test_a_goal_from_ros_2_waits_until_its_feedback_is_heard(
    sides: Sides, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same the other way; what it came through may go meanwhile."""
    monkeypatch.setattr(services, "FEEDBACK_SEC", 1e6)
    name = f"{ACTION}/send_goal"
    accept = TYPES[name].Response(accepted=True)
    served = sides.own.create_service(TYPES[name], name, lambda request: accept)
    service = sides.show_there(name)
    service.ask(TYPES[name].Request(), 1)
    sides.inbound.hide(mirror(name))
    assert not service.responses[1].accepted
    service = sides.show_there(name)
    service.ask(TYPES[name].Request(), 2)
    subscription = sides.bare.create_subscription(FEEDBACK, f"{ACTION}/feedback", lambda message: None, 10)
    sides.feedback = FeedbackFromHere(subscription)
    await until(lambda: service.responses)
    assert service.responses[2].accepted
    assert served.calls == 1


async def test_a_result_follows_the_feedback_that_ros_2_has_published(sides: Sides) -> None:
    """Also what has arrived and not been taken yet: the client here gets it before."""
    name = f"{ACTION}/get_result"
    sides.show_here(name)
    topic = FeedbackFromRos(sides.bare.create_publisher(FEEDBACK, f"{ACTION}/feedback", 10))
    sides.feedback = topic
    client = await sides.client(name)
    received: list[Any] = []
    heard = sides.own.create_subscription(FEEDBACK, f"{ACTION}/feedback", received.append, 10)
    client.receive_after(heard)
    await topic.publisher_on("/there").wait_for_subscriptions()
    call = client.call_async(TYPES[name].Request(), None)
    await until(lambda: len(sides.ros.clients) == 1)
    topic.arrived = [FEEDBACK(), FEEDBACK()]
    sides.ros.client.respond(1, TYPES[name].Response(status=4))
    assert topic.arrived == []
    assert (await call).status == 4
    assert len(received) == 2


async def test_a_result_from_here_follows_the_feedback_into_ros_2(sides: Sides) -> None:
    """The response is sent when the feedback has been handed over that the server has published before."""
    name = f"{ACTION}/get_result"
    feedback = sides.own.create_publisher(FEEDBACK, f"{ACTION}/feedback", 10)
    events: list[str] = []

    def crossed(_: object) -> None:
        events.append("feedback")

    subscription = sides.bare.create_subscription(FEEDBACK, f"{ACTION}/feedback", crossed, 10)
    sides.feedback = FeedbackFromHere(subscription)
    await feedback.wait_for_subscriptions()

    def result(request: Any) -> Any:
        feedback.publish(FEEDBACK())
        return TYPES[name].Response(status=4)

    sides.own.create_service(TYPES[name], name, result).reply_after(feedback)
    service = sides.show_there(name)
    service.on_response = lambda: events.append("result")
    for number in range(2):
        service.ask(TYPES[name].Request(), number)
        await until(partial(service.has, number))
    assert events == ["feedback", "result"] * 2


async def test_standard_services_take_no_more_memory_in_ros_2_than_its_own(sides: Sides) -> None:
    """Every node has seven, and few are called; others lose no requests while the loop is busy."""
    sides.show_there("/list_parameters")
    sides.show_there()
