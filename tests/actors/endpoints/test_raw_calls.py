"""Clients and services with `raw=True`: they send and get encoded messages, and every call ends as usual."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.interfaces.action_msgs.msg import GoalStatus
from actors.interfaces.codec import Codec, codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_srvs.srv import SetBool
from actors.interfaces.unique_identifier_msgs.msg import UUID
from tests.actors.meeting import DEADLINE_SEC, MIB, Blow, latched, until

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting

REQUESTS = codec_for(AddTwoInts.Request)
RESPONSES = codec_for(AddTwoInts.Response)
INVALID = [b"", b"\x00\x01\x00\x00", b"\xa1x"]
"""Nothing, the head of CDR, and a string."""


def request(a: int = 1, b: int = 2) -> bytes:
    return REQUESTS.encode(AddTwoInts.Request(a=a, b=b))


def response(total: int = 3) -> bytes:
    return RESPONSES.encode(AddTwoInts.Response(sum=total))


def add(data: bytes) -> bytes:
    assert type(data) is bytes
    decoded = REQUESTS.decode(data)
    return response(decoded.a + decoded.b)


async def add_later(data: bytes) -> bytes:
    await asyncio.sleep(0)
    return add(data)


def add_in_future(data: bytes) -> asyncio.Future[bytes]:
    reply: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()
    asyncio.get_running_loop().call_soon(reply.set_result, add(data))
    return reply


class Ends:
    """A node with services and a node with clients."""

    def __init__(self, server: actors.Node, caller: actors.Node) -> None:
        self.server, self.caller = server, caller

    async def raw_client(self, srv_type: Any = AddTwoInts) -> Any:
        """Return a raw client of the service `add`, which there must be."""
        client = self.caller.create_client(srv_type, "add", raw=True)
        assert await client.wait_for_service(DEADLINE_SEC)
        return client

    async def typed_client(self) -> Any:
        """Return a client of the service `add`, which there must be."""
        client = self.caller.create_client(AddTwoInts, "add")
        assert await client.wait_for_service(DEADLINE_SEC)
        return client


@pytest.fixture
async def ends(meeting: Meeting) -> Ends:
    return Ends(await meeting.node("server"), await meeting.node("caller"))


@pytest.mark.parametrize("handler", [add, add_later, add_in_future])
@pytest.mark.parametrize("concurrent", [False, True])
async def test_a_raw_service_answers_raw_and_typed_clients(
    ends: Ends, handler: Any, *, concurrent: bool
) -> None:
    """`def`, `async def` and a future; the handler gets bytes, and the callers what they are made for."""
    service = ends.server.create_service(AddTwoInts, "add", handler, concurrent=concurrent, raw=True)
    raw, typed = await ends.raw_client(), await ends.typed_client()
    assert RESPONSES.decode(await raw.call(request(4, 5))).sum == 9
    assert (await typed.call(AddTwoInts.Request(a=6, b=7))).sum == 13
    assert (service.calls, service.served, service.errors) == (2, 2, 0)


@pytest.mark.parametrize("kind", [bytes, bytearray, memoryview])
async def test_a_raw_client_calls_a_typed_service(ends: Ends, kind: Any) -> None:
    """With bytes or any other buffer; the reply is bytes."""
    ends.server.create_service(
        AddTwoInts, "add", lambda request: AddTwoInts.Response(sum=request.a + request.b)
    )
    client = await ends.raw_client()
    reply = await client.call(kind(request()))
    assert type(reply) is bytes
    assert RESPONSES.decode(reply).sum == 3


async def test_bytes_pass_unchanged_and_are_not_decoded(ends: Ends, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fields that the type does not have, too, in both directions."""
    got: list[bytes] = []

    def echo(data: bytes) -> memoryview:
        got.append(data)
        return memoryview(b"\x81\xa5other\xa1y")

    def refuse(codec: Codec[Any], data: bytes, *_: object) -> None:
        raise AssertionError(f"decoded {data!r}")

    ends.server.create_service(AddTwoInts, "add", echo, raw=True)
    client = await ends.raw_client()
    with monkeypatch.context() as patch:
        patch.setattr(Codec, "decode", refuse)
        assert await client.call(b"\x81\xa7unknown\xa1x") == b"\x81\xa5other\xa1y"
    assert got == [b"\x81\xa7unknown\xa1x"]


@pytest.mark.parametrize("data", INVALID)
async def test_a_request_that_is_no_map_is_refused(ends: Ends, data: bytes) -> None:
    """As `publish_encoded` refuses it: nothing is sent."""
    service = ends.server.create_service(AddTwoInts, "add", add, raw=True)
    client = await ends.raw_client()
    with pytest.raises(InvalidMessageError, match="begins with a msgpack map"):
        client.call_async(data)
    for other in ("text", AddTwoInts.Request(), None):
        with pytest.raises(TypeError, match="Expected bytes, one message as msgpack, got"):
            await client.call(other)
    assert (client.pending, client.failed, service.calls) == (0, 0, 0)
    assert RESPONSES.decode(await client.call(request())).sum == 3


@pytest.mark.parametrize("result", [*INVALID, None, AddTwoInts.Response(), "text"])
async def test_a_handler_must_return_an_encoded_response(
    ends: Ends, caplog: pytest.LogCaptureFixture, result: Any
) -> None:
    """Anything else is an error at the server, counted, and a RemoteError at the caller."""
    ends.server.create_service(AddTwoInts, "add", lambda data: result, raw=True)
    client = await ends.raw_client()
    with pytest.raises(actors.RemoteError) as caught:
        await client.call(request())
    assert caught.value.type_name in {"TypeError", "InvalidMessageError"}
    assert (ends.server.callback_errors, client.failed) == (1, 1)
    assert "did not return a valid example_interfaces/srv/AddTwoInts_Response" in caplog.text


async def test_what_is_too_large_is_refused(meeting: Meeting) -> None:
    """A request at the client and a response at the server, as typed ones; the links stay."""
    await meeting.restart_broker(max_message_bytes=MIB)
    ends = Ends(await meeting.node("server"), await meeting.node("caller"))
    large = codec_for(Blow.Request).encode(Blow.Request(data=bytes(2 * MIB)))
    ends.server.create_service(Blow, "add", lambda data: large, raw=True)
    client = await ends.raw_client(Blow)
    with pytest.raises(InvalidMessageError, match="over the limit of"):
        await client.call(large)
    with pytest.raises(actors.RemoteError, match="over the limit of"):
        await client.call(b"\x80")
    assert ends.server.connected
    assert ends.caller.connected


async def test_large_bytes_travel_in_both_directions(ends: Ends) -> None:
    """Requests and responses of several fragments."""
    large = codec_for(Blow.Response).encode(Blow.Response(data=bytes(range(256)) * 8192))
    ends.server.create_service(Blow, "add", lambda data: data, raw=True)
    client = await ends.raw_client(Blow)
    assert await client.call(large) == large


async def test_bytes_of_another_type_end_at_the_typed_end(ends: Ends) -> None:
    """Neither end that passes them on looks into them; the one that decodes says what is wrong."""
    service = ends.server.create_service(AddTwoInts, "add", lambda request: AddTwoInts.Response())
    raw = await ends.raw_client()
    with pytest.raises(actors.RemoteError) as caught:
        await raw.call(b"\x81\xa1a\xa1x")
    assert caught.value.type_name == "InvalidMessageError"
    assert service.calls == 0
    service.destroy()
    await until(lambda: not raw.service_is_ready())
    ends.server.create_service(AddTwoInts, "add", lambda data: b"\x81\xa3sum\xa1x", raw=True)
    typed = await ends.typed_client()
    with pytest.raises(actors.RemoteError) as caught:
        await typed.call(AddTwoInts.Request())
    assert caught.value.type_name == "InvalidMessageError"
    assert await raw.call(b"\x80") == b"\x81\xa3sum\xa1x"


async def test_calls_end_with_the_errors_of_typed_calls(ends: Ends, meeting: Meeting) -> None:
    """The handler raises; no reply in time; the caller gives up; the server, the client or all are gone."""
    entered, cancelled = asyncio.Event(), asyncio.Event()

    async def handle(data: bytes) -> bytes:
        if REQUESTS.decode(data).a:
            raise ValueError("no sum")
        entered.set()
        try:
            await asyncio.Event().wait()
        finally:
            cancelled.set()
        raise AssertionError

    service = ends.server.create_service(AddTwoInts, "add", handle, concurrent=True, raw=True)
    client = await ends.raw_client()
    with pytest.raises(actors.RemoteError, match="no sum"):
        await client.call(request())
    with pytest.raises(actors.ServiceTimeout):
        await client.call(request(0), timeout_sec=0.01)
    assert client.timeouts == 1
    call = client.call_async(request(0))
    await entered.wait()
    cancelled.clear()
    call.cancel()
    await cancelled.wait()
    call = client.call_async(request(0))
    await until(lambda: service.pending == 1)
    service.destroy()
    with pytest.raises(actors.ServiceUnavailable):
        await call
    with pytest.raises(actors.ServiceUnavailable):
        await client.call(request(0))
    call = meeting.absent("alone").create_client(AddTwoInts, "add", raw=True)
    call.destroy()
    with pytest.raises(actors.NodeDestroyed):
        call.call_async(request(0))


async def test_a_call_before_the_first_session_keeps_its_bytes(ends: Ends, meeting: Meeting) -> None:
    """Although the caller's buffer changes before they are sent."""
    ends.server.create_service(AddTwoInts, "add", add, raw=True)
    client = await ends.raw_client()
    data = bytearray(request(20, 3))
    call = client.call_async(data)
    data[:] = bytes(len(data))
    assert RESPONSES.decode(await call).sum == 23


async def test_the_type_is_declared_and_compared(ends: Ends) -> None:
    """A raw client of another type does not match, as a typed one."""
    ends.server.create_service(AddTwoInts, "add", add, raw=True)
    await ends.raw_client()
    other = ends.caller.create_client(SetBool, "add", raw=True)
    with pytest.raises(actors.ServiceUnavailable):
        await other.call(b"\x80")
    assert not other.service_is_ready()


async def test_a_handler_takes_one_argument(ends: Ends) -> None:
    """There is no response that it could fill in; the type is needed as for typed ones."""
    with pytest.raises(RuntimeError, match="takes 1 argument;"):
        ends.server.create_service(AddTwoInts, "add", lambda request, response: b"", raw=True)  # type: ignore[call-overload]
    with pytest.raises(TypeError, match="no service type"):
        ends.server.create_service(AddTwoInts.Request, "add", add, raw=True)  # type: ignore[call-overload]
    with pytest.raises(TypeError, match="no service type"):
        ends.caller.create_client(None, "add", raw=True)  # type: ignore[call-overload]


async def test_a_method_can_be_a_raw_service(meeting: Meeting) -> None:
    """`@actors.service(..., raw=True)`."""

    class Adder(actors.Node):
        @actors.service(AddTwoInts, "add", raw=True)
        def on_add(self, data: bytes) -> bytes:
            return add(data)

    async with Adder("adder", url=meeting.url) as node:
        client = node.create_client(AddTwoInts, "add", raw=True)
        assert await client.wait_for_service(DEADLINE_SEC)
        assert RESPONSES.decode(await client.call(request())).sum == 3


async def test_introspection_decodes_only_contents(ends: Ends) -> None:
    """Events have the messages of the call; without a valid one the event is counted as lost."""
    service = ends.server.create_service(AddTwoInts, "add", add, raw=True)
    client = await ends.raw_client()
    events: list[Any] = []
    topic = ends.caller.create_subscription(AddTwoInts.Event, "add/_service_event", events.append, 100)
    clock, states = ends.caller.get_clock(), actors.ServiceIntrospectionState
    for end in (client, service):
        end.configure_introspection(clock, 100, states.CONTENTS)
    await until(lambda: topic.get_publisher_count() == 2)
    await client.call(request(30, 4))
    await until(lambda: len(events) == 4)
    by_kind = {event.info.event_type: event for event in events}
    assert by_kind[0].request == by_kind[1].request == [AddTwoInts.Request(a=30, b=4)]
    assert by_kind[2].response == by_kind[3].response == [AddTwoInts.Response(sum=34)]
    with pytest.raises(actors.RemoteError):
        await client.call(b"\x81\xa1a\xa1x")
    assert (client.events_lost, service.events_lost) == (1, 1)
    client.configure_introspection(clock, 100, states.METADATA)
    with pytest.raises(actors.RemoteError):
        await client.call(b"\x81\xa1a\xa1x")
    assert client.events_lost == 0


IMPL: Any = Fibonacci.Impl
GOALS, ACCEPTED = codec_for(IMPL.SendGoalService.Request), codec_for(IMPL.SendGoalService.Response)
WANTED, RESULTS = codec_for(IMPL.GetResultService.Request), codec_for(IMPL.GetResultService.Response)
FEEDBACK = codec_for(IMPL.FeedbackMessage)


async def test_raw_ends_stand_in_for_an_actions_client(ends: Ends) -> None:
    """An action's services and topics are ordinary endpoints: raw ones send a goal and get its result."""

    async def execute(goal: Any) -> Fibonacci.Result:
        goal.publish_feedback(Fibonacci.Feedback(sequence=[0, 1]))
        goal.succeed()
        return Fibonacci.Result(sequence=[0, 1, 1])

    ends.server.create_action_server(Fibonacci, "fibonacci", execute)
    send = ends.caller.create_client(IMPL.SendGoalService, "fibonacci/_action/send_goal", raw=True)
    get = ends.caller.create_client(IMPL.GetResultService, "fibonacci/_action/get_result", raw=True)
    feedback: list[bytes] = []
    topic = ends.caller.create_subscription(
        IMPL.FeedbackMessage, "fibonacci/_action/feedback", feedback.append, raw=True
    )
    assert await send.wait_for_service(DEADLINE_SEC)
    assert await get.wait_for_service(DEADLINE_SEC)
    await until(lambda: topic.get_publisher_count() == 1)
    goal_id = UUID(uuid=bytes(range(16)))
    goal = IMPL.SendGoalService.Request(goal_id=goal_id, goal=Fibonacci.Goal(order=2))
    assert ACCEPTED.decode(await send.call(GOALS.encode(goal))).accepted
    wanted = WANTED.encode(IMPL.GetResultService.Request(goal_id=goal_id))
    ended = RESULTS.decode(await get.call(wanted))
    assert (ended.status, list(ended.result.sequence)) == (GoalStatus.STATUS_SUCCEEDED, [0, 1, 1])
    await until(lambda: len(feedback) == 1)
    assert list(FEEDBACK.decode(feedback[0]).feedback.sequence) == [0, 1]


async def test_raw_ends_stand_in_for_an_actions_server(ends: Ends) -> None:
    """Raw services and publishers with the names of an action answer an `ActionClient`."""
    server, heard = ends.server, asyncio.Event()

    def accept(data: bytes) -> bytes:
        request = GOALS.decode(data)
        if request.goal.order != 2:
            return ACCEPTED.encode(IMPL.SendGoalService.Response(accepted=False))
        told = IMPL.FeedbackMessage(goal_id=request.goal_id, feedback=Fibonacci.Feedback(sequence=[7]))
        feedback.publish_encoded(FEEDBACK.encode(told))
        return ACCEPTED.encode(IMPL.SendGoalService.Response(accepted=True))

    async def finish(data: bytes) -> bytes:
        await heard.wait()
        result = Fibonacci.Result(sequence=[8])
        status = GoalStatus.STATUS_SUCCEEDED
        return RESULTS.encode(IMPL.GetResultService.Response(status=status, result=result))

    feedback = server.create_publisher(IMPL.FeedbackMessage, "fibonacci/_action/feedback")
    server.create_publisher(IMPL.GoalStatusMessage, "fibonacci/_action/status", latched(1))
    server.create_service(IMPL.SendGoalService, "fibonacci/_action/send_goal", accept, raw=True)
    server.create_service(
        IMPL.GetResultService, "fibonacci/_action/get_result", finish, concurrent=True, raw=True
    )
    server.create_service(
        IMPL.CancelGoalService, "fibonacci/_action/cancel_goal", lambda data: b"\x80", raw=True
    )
    client = ends.caller.create_action_client(Fibonacci, "fibonacci")
    assert await client.wait_for_server(DEADLINE_SEC)
    await until(lambda: feedback.get_subscription_count() == 1)
    assert not (await client.send_goal(Fibonacci.Goal(order=1))).accepted
    told: list[int] = []

    def on_feedback(message: Any) -> None:
        told.extend(message.feedback.sequence)
        heard.set()

    goal = await client.send_goal(Fibonacci.Goal(order=2), on_feedback)
    assert goal.accepted
    result = await goal.result()
    assert (told, list(result.result.sequence)) == ([7], [8])


@pytest.mark.parametrize(
    ("error", "seen", "text"),
    [
        (actors.ServiceUnavailable("none behind"), actors.ServiceUnavailable, "none behind"),
        (actors.ServiceOverloaded("full behind"), actors.ServiceOverloaded, "full behind"),
        (actors.ServiceTimeout("late behind"), actors.ServiceTimeout, "late behind"),
        (actors.RemoteError("ValueError", "no sum", "/behind"), actors.RemoteError, "ValueError: no sum"),
        (actors.GoalUnknown("no goal"), actors.RemoteError, "GoalUnknown: no goal"),
    ],
)
async def test_a_forwarded_call_ends_as_the_one_behind(
    ends: Ends, error: Exception, seen: type[Exception], text: str
) -> None:
    """What a handler's own call raises reaches the caller as it is, and is no fault of the forwarder."""

    async def forward(data: bytes) -> bytes:
        raise error

    service = ends.server.create_service(AddTwoInts, "add", forward, concurrent=True, raw=True)
    client = await ends.typed_client()
    with pytest.raises(seen) as caught:
        await client.call(AddTwoInts.Request(), timeout_sec=None)
    assert type(caught.value) is seen
    assert text in str(caught.value)
    assert "/add" in str(caught.value)
    assert (service.errors, ends.server.callback_errors) == (1, 0)
