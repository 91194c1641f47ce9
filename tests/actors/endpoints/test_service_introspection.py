"""Service introspection: what both ends tell of a call, that it harms nothing, and that it costs nothing."""

from __future__ import annotations

import asyncio
import inspect
from contextlib import nullcontext
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.endpoints.service_introspection import CallIdentity, EventKind
from actors.endpoints.service_introspection import ServiceIntrospectionState as State
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.service_msgs.msg import ServiceEventInfo
from actors.time.clock import Clock
from actors.time.types import ClockType
from proto.errors import InvalidTopicNameError
from tests.actors.meeting import KEEP_ALL, MIB, Blow, matched, until
from tests.seams.limits import set_limits
from tests.seams.nodes import context_of, invalid_requests

if TYPE_CHECKING:
    from actors.endpoints.service.service import ServiceServer
    from tests.actors.meeting import Meeting

ASK = AddTwoInts.Request(a=1, b=2)
CLOCK = Clock(source=lambda: 5_000_000_007)


def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
    return AddTwoInts.Response(sum=request.a + request.b)


class Watch:
    """A server, a client of it, and somebody who reads the events of both."""

    def __init__(self, meeting: Meeting) -> None:
        self.meeting = meeting
        self.events: list[Any] = []
        self.server: actors.Node
        self.caller: actors.Node
        self.service: ServiceServer[Any, Any]
        self.client: actors.Client[Any, Any]

    async def open(self, callback: Any, srv_type: Any = AddTwoInts, **options: Any) -> None:
        meeting = self.meeting
        self.server = await meeting.node("server")
        self.caller = await meeting.node("caller")
        watcher = await meeting.node("watcher")
        self.service = self.server.create_service(srv_type, "add", callback, **options)
        self.client = self.caller.create_client(srv_type, "add")
        self.received = watcher.create_subscription(
            srv_type.Event, "add/_service_event", self.events.append, KEEP_ALL
        )
        assert await self.client.wait_for_service(20)

    async def tell(self, server: State, client: State, qos: actors.QoSProfile | int = KEEP_ALL) -> None:
        self.service.configure_introspection(CLOCK, qos, server)
        self.client.configure_introspection(CLOCK, qos, client)
        await matched(self.received, (server is not State.OFF) + (client is not State.OFF))

    @property
    def kinds(self) -> list[str]:
        """The names of the events so far, in the order of a call."""
        return [EventKind(kind).name for kind in sorted(event.info.event_type for event in self.events)]


@pytest.fixture
async def watch(meeting: Meeting) -> Watch:
    """A watched service, to be opened with a handler."""
    return Watch(meeting)


FOUR = ["REQUEST_SENT", "REQUEST_RECEIVED", "RESPONSE_SENT", "RESPONSE_RECEIVED"]


def test_the_events_have_ros_2s_numbers() -> None:
    """As service_msgs/msg/ServiceEventInfo has them."""
    for kind in EventKind:
        assert getattr(ServiceEventInfo, kind.name) == kind


@pytest.mark.parametrize("concurrent", [False, True])
@pytest.mark.parametrize("kind", ["def", "async def"])
async def test_metadata_is_four_events_of_one_call(watch: Watch, kind: str, *, concurrent: bool) -> None:
    """Four events without contents, of one client and one number, each stamped by the clock given."""

    async def slow(request: AddTwoInts.Request) -> AddTwoInts.Response:
        await asyncio.sleep(0)
        return add(request)

    await watch.open(add if kind == "def" else slow, concurrent=concurrent)
    await watch.tell(State.METADATA, State.METADATA)
    assert (await watch.client.call(ASK)).sum == 3
    await until(lambda: len(watch.events) == 4)
    assert watch.kinds == FOUR
    for event in watch.events:
        assert (event.request, event.response) == ([], [])
        assert (event.info.stamp.sec, event.info.stamp.nanosec) == (5, 7)
        assert (bytes(event.info.client_gid), event.info.sequence_number) == (watch.client.gid, 1)
    await watch.client.call(ASK)
    await until(lambda: len(watch.events) == 8)
    assert {event.info.sequence_number for event in watch.events[4:]} == {2}


async def test_contents_come_with_their_events(watch: Watch) -> None:
    """The request in both REQUEST events, as it was sent, the response in both RESPONSE events."""

    def handle(request: AddTwoInts.Request) -> AddTwoInts.Response:
        answer = add(request)
        request.a = 99
        return answer

    await watch.open(handle)
    await watch.tell(State.CONTENTS, State.CONTENTS)
    await watch.client.call(ASK)
    await until(lambda: len(watch.events) == 4)
    assert watch.kinds == FOUR
    for event in watch.events:
        about_request = event.info.event_type in {EventKind.REQUEST_SENT, EventKind.REQUEST_RECEIVED}
        assert event.request == ([ASK] if about_request else [])
        assert event.response == ([] if about_request else [AddTwoInts.Response(sum=3)])


async def test_each_end_tells_for_itself(watch: Watch) -> None:
    """A server alone tells its two events, of a client without a name; so does a client; OFF ends it."""
    await watch.open(add)
    await watch.tell(State.METADATA, State.OFF)
    await watch.client.call(ASK)
    await until(lambda: len(watch.events) == 2)
    assert watch.kinds == FOUR[1:3]
    assert bytes(watch.events[0].info.client_gid) == bytes(16)
    assert watch.events[0].info.sequence_number == watch.events[1].info.sequence_number
    watch.events.clear()
    await watch.tell(State.OFF, State.METADATA)
    await watch.client.call(ASK)
    await until(lambda: len(watch.events) == 2)
    assert watch.kinds == [FOUR[0], FOUR[3]]
    watch.events.clear()
    await watch.tell(State.OFF, State.OFF)
    await watch.client.call(ASK)
    await watch.meeting.settled(watch.server, watch.caller)
    assert watch.events == []
    assert len(context_of(watch.server).endpoints) == len(context_of(watch.caller).endpoints) == 1


@pytest.mark.parametrize("how", ["raises", "returns nonsense", "cannot read"])
async def test_a_call_without_a_response_has_no_event_of_one(watch: Watch, how: str) -> None:
    """The request is reported, at the server if its handler saw it; the next call has all four events."""
    bad = True

    def handle(request: AddTwoInts.Request) -> Any:
        if bad and how == "raises":
            raise ValueError("no")
        return None if bad else add(request)

    await watch.open(handle)
    await watch.tell(State.CONTENTS, State.CONTENTS)
    unreadable = invalid_requests(watch.client) if how == "cannot read" else nullcontext()
    with unreadable, pytest.raises(actors.RemoteError):
        await watch.client.call(ASK)
    bad = False
    await watch.client.call(ASK)
    failed = 1 if how == "cannot read" else 2
    await until(lambda: len(watch.events) == failed + 4)
    first = [event for event in watch.events if event.info.sequence_number == 1]
    assert sorted(EventKind(event.info.event_type).name for event in first) == sorted(FOUR[:failed])


async def test_a_call_that_never_leaves_is_not_reported(meeting: Meeting) -> None:
    """Without a broker, and with a wrong request, there is no call to tell of."""
    caller = await meeting.node("caller")
    client = caller.create_client(AddTwoInts, "add")
    client.configure_introspection(CLOCK, 10, State.CONTENTS)
    with pytest.raises(TypeError):
        client.call_async("text")  # type: ignore[arg-type]
    await meeting.stop_broker()
    await until(lambda: not caller.connected)
    with pytest.raises(actors.ServiceUnavailable):
        await client.call(ASK)
    assert [publisher.published for publisher in caller.diagnostics().publishers] == [0]


async def test_an_event_that_does_not_fit_is_lost_and_the_call_goes_on(
    meeting: Meeting, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A request that just fits the broker does not fit an event: counted, said once, harmless."""
    set_limits(monkeypatch, lost_event_warning_sec=1000)
    await meeting.restart_broker(max_message_bytes=MIB)
    watch = Watch(meeting)
    await watch.open(lambda request: Blow.Response(data=bytes(request.size)), Blow)
    await watch.tell(State.CONTENTS, State.CONTENTS)
    await watch.client.call(Blow.Request(data=bytes(MIB - 300)))
    await watch.client.call(Blow.Request(data=bytes(MIB - 300)))
    assert watch.client.events_lost == watch.service.events_lost == 2
    assert caplog.text.count("Dropped a service event") == 2  # of four: once for each end
    await until(lambda: len(watch.events) == 4)
    assert watch.kinds == [FOUR[2]] * 2 + [FOUR[3]] * 2


async def test_a_full_topic_does_not_stop_calls(watch: Watch, monkeypatch: pytest.MonkeyPatch) -> None:
    """KEEP_ALL behind a reader that does not read: events are lost, calls are not."""
    set_limits(monkeypatch, keep_all_messages=3)
    await watch.open(add)
    await watch.tell(State.METADATA, State.OFF)
    calls = [watch.client.call_async(ASK) for _ in range(100)]
    assert [reply.sum for reply in await asyncio.gather(*calls)] == [3] * 100
    await until(lambda: len(watch.events) + watch.service.events_lost == 200)
    assert watch.service.events_lost
    assert watch.client.events_lost == 0


async def test_the_topic_lives_as_long_as_its_teller(watch: Watch) -> None:
    """A client or service that is destroyed takes its events back, and tells nothing any more."""
    await watch.open(add)
    await watch.tell(State.CONTENTS, State.CONTENTS)
    watch.client.destroy()
    await matched(watch.received, 1)
    watch.service.destroy()
    await matched(watch.received, 0)
    assert not context_of(watch.server).endpoints
    assert not context_of(watch.caller).endpoints
    for teller in (watch.client, watch.service):
        with pytest.raises(actors.NodeDestroyed):
            teller.configure_introspection(CLOCK, 10, State.METADATA)


async def test_a_node_that_stops_takes_its_events_along(meeting: Meeting) -> None:
    """A handler that ends after the node's topics have gone does not fail for it."""
    node = meeting.absent("server")
    async with node:
        service = node.create_service(AddTwoInts, "add", add)
        service.configure_introspection(CLOCK, 10, State.METADATA)
        for entity in tuple(context_of(node).endpoints):
            if isinstance(entity, actors.Publisher):
                entity.destroy()
        await until(lambda: node.connected)
        client = node.create_client(AddTwoInts, "add")
        assert await client.wait_for_service(20)
        assert (await client.call(ASK)).sum == 3
    assert not context_of(node).endpoints


async def test_wrong_arguments_change_nothing(watch: Watch) -> None:
    """No state, no QoS, no room for the topic's name: an error, and it goes on as before."""
    await watch.open(add)
    await watch.tell(State.METADATA, State.METADATA)
    with pytest.raises(ValueError, match="7"):
        watch.service.configure_introspection(CLOCK, 10, 7)  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        watch.client.configure_introspection(CLOCK, "often", State.METADATA)  # type: ignore[arg-type]
    await watch.client.call(ASK)
    await until(lambda: len(watch.events) == 4)
    long = watch.server.create_service(AddTwoInts, "a" * 240, add)
    with pytest.raises(InvalidTopicNameError):
        long.configure_introspection(CLOCK, 10, State.METADATA)


async def test_the_qos_is_the_topics(watch: Watch) -> None:
    """The profile given is that of the event publisher; configuring anew replaces it."""
    await watch.open(add)
    for depth in (3, 7):
        watch.service.configure_introspection(Clock(ClockType.STEADY_TIME), depth, State.METADATA)
        (publisher,) = watch.server.diagnostics().publishers
        assert (publisher.topic, publisher.queue_limit) == ("/add/_service_event", depth)


@pytest.mark.parametrize(
    "attributes",
    [
        None,
        {},
        {"client_gid": b"short", "sequence_number": -1},
        {"client_gid": "x" * 16, "sequence_number": 2**63},
        {"client_gid": None, "sequence_number": True},
        {"client_gid": 1, "sequence_number": 1.0},
    ],
)
def test_a_call_without_an_identity_gets_one(attributes: Any) -> None:
    """What a peer in another language sends may be anything: zeros, and the broker's call id, instead."""
    assert CallIdentity.of(attributes, 12) == (bytes(16), 12)
    assert CallIdentity.of(attributes, 2**64 - 1) == (bytes(16), 2**63 - 1)


def test_rclpys_signature() -> None:
    """The arguments have rclpy's names and order, at both ends."""
    for end in (actors.Client, type(actors.Node("n").create_service(AddTwoInts, "add", add))):
        names = list(inspect.signature(end.configure_introspection).parameters)
        assert names == ["self", "clock", "service_event_qos_profile", "introspection_state"]
    assert [state.name for state in actors.ServiceIntrospectionState] == ["OFF", "METADATA", "CONTENTS"]
