"""Clients: every ending that a call can have."""

from __future__ import annotations

import asyncio
import math
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.endpoints.endpoint import endpoint_of
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.example_interfaces.srv import AddTwoInts
from broker import Broker, BrokerOptions
from proto.errors import InvalidServiceNameError
from proto.wire.codes import Status
from proto.wire.frames import ReplyEntry
from tests.actors.meeting import DEADLINE_SEC, turns, until
from tests.seams.limits import set_limits
from tests.seams.nodes import link_of
from tests.simulation.stage import Stage, play

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

    from tests.actors.meeting import Meeting

ASK = AddTwoInts.Request(a=1, b=2)


def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
    return AddTwoInts.Response(sum=request.a + request.b)


class Sloth:
    """A handler that answers when it is let; tells how it ended."""

    def __init__(self) -> None:
        self.entered = asyncio.Event()
        self.leave = asyncio.Event()
        self.ends: list[str] = []

    async def __call__(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        self.entered.set()
        try:
            await self.leave.wait()
        except asyncio.CancelledError:
            self.ends.append("cancelled")
            raise
        self.ends.append("done")
        return add(request)


@pytest.fixture
async def lonely(tmp_path: Path) -> AsyncIterator[actors.Client[Any, Any]]:
    """A client in a running node that never finds a broker."""
    async with actors.Node("lonely", url=f"callboard+unix://{tmp_path}/none") as node:
        yield node.create_client(AddTwoInts, "add")


async def pair(meeting: Meeting, callback: Any) -> tuple[actors.Node, actors.Client[Any, Any]]:
    """Return a serving node and a client of it in another."""
    server, caller = await meeting.node("server"), await meeting.node("caller")
    server.create_service(AddTwoInts, "add", callback, concurrent=True)
    client = caller.create_client(AddTwoInts, "add")
    assert await client.wait_for_service(20)
    return server, client


async def test_waiting_for_a_service_that_never_comes(lonely: actors.Client[Any, Any]) -> None:
    """False at the timeout; with 0, or less, at once; without a broker just the same."""
    loop = asyncio.get_running_loop()
    start = loop.time()
    assert not await lonely.wait_for_service(0)
    assert not await lonely.wait_for_service(-1)
    assert not await lonely.wait_for_service(0.05)
    assert 0.05 <= loop.time() - start < DEADLINE_SEC
    assert not lonely.service_is_ready()


async def test_waiting_for_a_service_that_is_there(meeting: Meeting) -> None:
    """True at once, without a turn of the loop."""
    _, client = await pair(meeting, add)
    assert client.service_is_ready()
    async with asyncio.timeout(0):
        assert await client.wait_for_service(1.0)


async def test_waiting_for_a_service_that_comes(meeting: Meeting) -> None:
    """A wait without a limit ends when the server appears, also behind a broker's restart."""
    server, caller = await meeting.node("server"), await meeting.node("caller")
    client = caller.create_client(AddTwoInts, "add")
    waiting = asyncio.create_task(client.wait_for_service())
    await meeting.settled(server, caller)
    assert not waiting.done()
    server.create_service(AddTwoInts, "add", add)
    async with asyncio.timeout(20):
        assert await waiting


async def test_waits_can_be_cancelled_from_outside(lonely: actors.Client[Any, Any]) -> None:
    """`asyncio.timeout` around a wait, or around a call, works as everywhere."""
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(0.01):
            await lonely.wait_for_service()

    async def watch() -> None:
        while True:  # a failed attempt to connect changes the link, too
            await endpoint_of(lonely).context.link.changed()

    with pytest.raises(TimeoutError):
        async with asyncio.timeout(0.01):
            await watch()


async def test_calls_in_flight_are_matched_to_their_replies(meeting: Meeting) -> None:
    """Two calls on one client, answered in the other order, get each its own reply."""
    first = asyncio.Event()

    async def handle(request: AddTwoInts.Request) -> AddTwoInts.Response:
        if request.a == 1:
            await first.wait()
        else:
            first.set()
        return add(request)

    _, client = await pair(meeting, handle)
    slow, swift = client.call_async(AddTwoInts.Request(a=1)), client.call_async(AddTwoInts.Request(a=5))
    assert client.pending == 2
    assert ((await swift).sum, (await slow).sum) == (5, 1)
    assert client.pending == 0


@pytest.mark.parametrize("request_", ["text", AddTwoInts.Response(), None])
async def test_a_wrong_request_is_refused(meeting: Meeting, request_: Any) -> None:
    """TypeError from call and call_async, and nothing is sent."""
    _, client = await pair(meeting, add)
    with pytest.raises(TypeError, match="Expected example_interfaces/srv/AddTwoInts_Request"):
        client.call_async(request_)
    with pytest.raises(TypeError):
        await client.call(request_)
    with pytest.raises(InvalidMessageError):
        await client.call(AddTwoInts.Request(a="x"))  # type: ignore[arg-type]
    assert client.pending == 0
    assert meeting.broker.stats().calls == 0


@pytest.mark.parametrize("timeout", [-1, -0.001, math.nan, -math.inf])
async def test_a_bad_timeout_is_refused(meeting: Meeting, timeout: float) -> None:
    """A timeout is zero or more."""
    _, client = await pair(meeting, add)
    with pytest.raises(ValueError, match="timeout_sec"):
        client.call_async(ASK, timeout)
    assert client.pending == 0


@pytest.mark.parametrize("timeout", [None, 5, 1e300, math.inf])
async def test_a_reply_ends_a_call(meeting: Meeting, timeout: float | None) -> None:
    """A reply, whatever the limit, also an absurd one or none."""
    _, client = await pair(meeting, add)
    assert (await client.call(ASK, timeout)).sum == 3


@pytest.mark.parametrize("timeout", [0, 0.02])
def test_a_deadline_ends_a_call(timeout: float) -> None:
    """ServiceTimeout, a TimeoutError; the handler is cancelled; the next call works."""

    async def scene(stage: Stage) -> None:
        sloth, server, caller = Sloth(), await stage.enter("server"), await stage.enter("caller")
        server.create_service(AddTwoInts, "add", sloth, concurrent=True)
        client = caller.create_client(AddTwoInts, "add")
        assert await client.wait_for_service(20)
        with pytest.raises(TimeoutError) as caught:
            await client.call(ASK, timeout)
        assert isinstance(caught.value, actors.ServiceTimeout)
        assert client.pending == 0
        await asyncio.sleep(1)
        assert sloth.ends == ["cancelled"] * sloth.entered.is_set()
        sloth.leave.set()
        assert (await client.call(ASK)).sum == 3
        assert sloth.ends.count("done") == 1
        assert server.callback_errors == 0

    play(scene)


def test_the_default_deadline_is_the_nodes() -> None:
    """timeout_sec=None means the node's default_call_timeout_sec."""

    async def scene(stage: Stage) -> None:
        sloth, server = Sloth(), await stage.enter("server")
        caller = await stage.enter("caller", default_call_timeout_sec=0.5)
        server.create_service(AddTwoInts, "add", sloth)
        client = caller.create_client(AddTwoInts, "add")
        assert await client.wait_for_service(20)
        began = stage.loop.time()
        with pytest.raises(actors.ServiceTimeout, match="'/add'"):
            await client.call(ASK)
        assert stage.loop.time() - began == pytest.approx(0.5)
        await stage.until(lambda: bool(sloth.ends))
        assert sloth.ends == ["cancelled"]

    play(scene)


async def test_no_server_fails_at_once(meeting: Meeting) -> None:
    """No server: ServiceUnavailable, at once, whatever the deadline."""
    caller = await meeting.node("caller")
    with pytest.raises(actors.ServiceUnavailable, match="'/nothing'"):
        await caller.create_client(AddTwoInts, "nothing").call(ASK, math.inf)


async def test_no_broker_fails_at_the_deadline(lonely: actors.Client[Any, Any]) -> None:
    """No broker: ServiceUnavailable, when the call's deadline passes; cancelling one ends it at once."""
    with pytest.raises(actors.ServiceUnavailable, match="not connected"):
        await lonely.call(ASK, 0.05)
    lonely.call_async(ASK, math.inf).cancel()
    assert lonely.pending == 0


async def test_the_servers_death_fails_its_calls(meeting: Meeting) -> None:
    """The server leaves, or its link is cut, in mid-call: ServiceUnavailable soon."""
    sloth = Sloth()
    server, client = await pair(meeting, sloth)
    call = client.call_async(ASK, math.inf)
    await sloth.entered.wait()
    channel = link_of(server).channel
    assert channel is not None
    channel.abort()
    async with asyncio.timeout(20):
        with pytest.raises(actors.ServiceUnavailable):
            await call
    await until(lambda: sloth.ends)
    assert sloth.ends == ["cancelled"]


async def test_the_brokers_death_fails_all_calls(meeting: Meeting) -> None:
    """The link breaks in mid-call: ServiceUnavailable at once; the handler is cancelled."""
    await meeting.restart_broker(drain_timeout_sec=0.1)  # which would wait for the call
    sloth = Sloth()
    _, client = await pair(meeting, sloth)
    call = client.call_async(ASK, math.inf)
    await sloth.entered.wait()
    await meeting.stop_broker()
    async with asyncio.timeout(20):
        with pytest.raises(actors.ServiceUnavailable, match="link to the broker broke"):
            await call
    await until(lambda: sloth.ends)


@pytest.mark.parametrize("how", ["task", "future"])
async def test_cancelling_cancels_the_handler(meeting: Meeting, how: str) -> None:
    """Cancelling the awaiting task, or the future, cancels the remote handler; the next call works."""
    sloth = Sloth()
    _, client = await pair(meeting, sloth)
    waiting: asyncio.Future[Any]
    waiting = asyncio.create_task(client.call(ASK)) if how == "task" else client.call_async(ASK)
    await sloth.entered.wait()
    waiting.cancel()
    await until(lambda: sloth.ends)
    assert waiting.cancelled()
    assert client.pending == 0
    sloth.leave.set()
    assert (await client.call(ASK)).sum == 3


async def test_a_destroyed_client_ends_its_calls(meeting: Meeting) -> None:
    """NodeDestroyed in the caller, and for calls after it; the handler is cancelled."""
    sloth = Sloth()
    _, client = await pair(meeting, sloth)
    call = client.call_async(ASK)
    await sloth.entered.wait()
    client.destroy()
    client.destroy()
    with pytest.raises(actors.NodeDestroyed):
        await call
    await until(lambda: sloth.ends)
    with pytest.raises(RuntimeError, match="destroyed"):
        await client.call(ASK)
    with pytest.raises(actors.NodeDestroyed):
        await client.wait_for_service(1)


async def test_a_wait_ends_with_its_client(meeting: Meeting) -> None:
    """A wait on a client that is destroyed meanwhile raises instead of hanging."""
    caller = await meeting.node("caller")
    client = caller.create_client(AddTwoInts, "add")
    waiting = asyncio.create_task(client.wait_for_service())
    await turns()
    client.destroy()
    async with asyncio.timeout(20):
        with pytest.raises(actors.NodeDestroyed):
            await waiting


async def test_an_invalid_reply_is_a_remote_error(meeting: Meeting) -> None:
    """A reply that does not decode, or a remote error that cannot be read, ends the call all the same."""
    sloth = Sloth()
    _, client = await pair(meeting, sloth)
    bad, worse = client.call_async(ASK), client.call_async(ASK)
    endpoint_of(client).replied((ReplyEntry(1, Status.OK, False, None, b"\xa1x"),))
    endpoint_of(client).replied((ReplyEntry(2, Status.REMOTE_ERROR, False, None, b"\xc1"),))
    with pytest.raises(actors.RemoteError) as caught:
        await bad
    assert caught.value.type_name == "InvalidMessageError"
    with pytest.raises(actors.RemoteError, match="cannot be read"):
        await worse
    endpoint_of(client).replied((ReplyEntry(2, Status.OK, False, None, b""),))
    assert client.late == 1


@pytest.mark.parametrize(
    ("status", "error", "text"),
    [
        (Status.UNAVAILABLE, actors.ServiceUnavailable, "Service '/add': what happened"),
        (Status.CANCELLED, actors.ServiceUnavailable, "Service '/add': what happened"),
        (Status.OVERLOADED, actors.ServiceOverloaded, "Service '/add': what happened"),
        (77, actors.RemoteError, "Service '/add' failed: Status 77: what happened"),
    ],
)
async def test_each_status_is_an_error_that_says_so(
    meeting: Meeting, status: int, error: type[Exception], text: str
) -> None:
    """Each has its type, and the text that came with it; one that this version does not know, too."""
    _, client = await pair(meeting, Sloth())
    call = client.call_async(ASK)
    endpoint_of(client).replied((ReplyEntry(1, status, False, None, b"what happened"),))
    with pytest.raises(actors.CallFailed) as caught:
        await call
    assert type(caught.value) is error
    assert str(caught.value) == text


async def test_too_many_calls_of_a_link_are_reported_as_that(meeting: Meeting) -> None:
    """Beyond the broker's limit a call is ServiceOverloaded, a ServiceUnavailable; an end makes room."""
    await meeting.restart_broker(max_pending_calls=10)
    sloth = Sloth()
    _, client = await pair(meeting, sloth)
    calls = [client.call_async(ASK) for _ in range(10)]
    with pytest.raises(actors.ServiceUnavailable, match="10 calls of this link wait already") as caught:
        await client.call(ASK)
    assert isinstance(caught.value, actors.ServiceOverloaded)
    calls.pop().cancel()
    calls.append(client.call_async(ASK))
    sloth.leave.set()
    assert [reply.sum for reply in await asyncio.gather(*calls)] == [3] * 10


async def test_too_many_calls_of_a_client_fail_before_they_leave(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The client has a limit of its own; those within it are not harmed."""
    set_limits(monkeypatch, pending_calls=3)
    sloth = Sloth()
    _, client = await pair(meeting, sloth)
    calls = [client.call_async(ASK) for _ in range(3)]
    with pytest.raises(
        actors.ServiceOverloaded, match="'/add': 3 calls of this client and 0 unsent bytes wait"
    ):
        await client.call(ASK)
    sloth.leave.set()
    assert [reply.sum for reply in await asyncio.gather(*calls)] == [3] * 3
    assert (await client.call(ASK)).sum == 3


async def test_a_call_given_up_before_it_leaves_never_leaves(meeting: Meeting) -> None:
    """Cancelled in the loop turn in which it was made: neither the request nor a CANCEL travels."""
    sloth = Sloth()
    server, client = await pair(meeting, sloth)
    kept, given_up = client.call_async(AddTwoInts.Request(a=1)), client.call_async(AddTwoInts.Request(a=2))
    given_up.cancel()
    sloth.leave.set()
    assert (await kept).sum == 1
    await meeting.settled(server)
    assert meeting.broker.stats().calls == 1
    assert sloth.ends == ["done"]


async def test_ten_thousand_calls_in_flight(meeting: Meeting) -> None:
    """10,000 calls at the same time end each with its own reply, in few frames, on one timer."""
    _, client = await pair(meeting, add)
    futures = [client.call_async(AddTwoInts.Request(a=number)) for number in range(10_000)]
    assert client.pending == 10_000
    replies = await asyncio.gather(*futures)
    assert [reply.sum for reply in replies] == list(range(10_000))
    assert client.pending == 0


async def test_ten_thousand_cancellations_in_one_turn(meeting: Meeting) -> None:
    """Case 39: 10,000 calls given up in one loop turn leave nothing behind."""
    server, client = await pair(meeting, Sloth())
    futures = [client.call_async(AddTwoInts.Request(a=number)) for number in range(10_000)]
    await turns()
    for future in futures:
        future.cancel()
    await until(lambda: not meeting.broker.stats().pending_calls)
    await until(lambda: not any(each.running or each.waiting for each in server.diagnostics().services))
    assert client.pending == 0


async def test_calls_need_a_running_node(tmp_path: Path) -> None:
    """A call on a node that does not run says how to run it."""
    client = actors.Node("early").create_client(AddTwoInts, "add")
    with pytest.raises(RuntimeError, match="async with node"):
        client.call_async(ASK)
    with pytest.raises(InvalidServiceNameError):
        actors.Node("early").create_client(AddTwoInts, "add?")


async def test_calls_in_callbacks_cannot_deadlock(meeting: Meeting) -> None:
    """A node that calls itself, and two nodes that call each other in a circle, get their answers."""
    left, right = await meeting.node("left"), await meeting.node("right")
    answers: list[int] = []

    def ask(node: actors.Node, name: str) -> Any:
        client = node.create_client(AddTwoInts, name)

        async def handle(request: AddTwoInts.Request) -> AddTwoInts.Response:
            if request.a == 0:
                return AddTwoInts.Response(sum=request.b)
            return await client.call(AddTwoInts.Request(a=request.a - 1, b=request.b + 1))

        return handle

    left.create_service(AddTwoInts, "l", ask(left, "r"))
    right.create_service(AddTwoInts, "r", ask(right, "l"))
    left.create_service(AddTwoInts, "self", ask(left, "self"))
    circle, own = left.create_client(AddTwoInts, "r"), left.create_client(AddTwoInts, "self")

    async def tick() -> None:
        timer.cancel()
        await circle.wait_for_service()
        await own.wait_for_service()
        replies = await asyncio.gather(
            circle.call(AddTwoInts.Request(a=10)),
            own.call(AddTwoInts.Request(a=7)),
            asyncio.create_task(own.call(AddTwoInts.Request(a=3))),
        )
        answers.extend(reply.sum for reply in replies)

    timer = left.create_timer(0, tick)
    await until(lambda: answers)
    assert answers == [10, 7, 3]
    assert left.callback_errors == right.callback_errors == 0


async def test_types_must_match(meeting: Meeting, caplog: pytest.LogCaptureFixture) -> None:
    """Another type on the same service does not connect, and both sides are warned."""
    server, caller = await meeting.node("server"), await meeting.node("caller")
    server.create_service(AddTwoInts, "add", add)
    client = caller.create_client(Other, "add")
    await meeting.settled(server, caller)
    assert not client.service_is_ready()
    with pytest.raises(actors.ServiceUnavailable):
        await client.call(Other.Request())
    warned = {record.name for record in caplog.records if "/add" in record.getMessage()}
    assert {"callboard.server", "callboard.caller"} <= warned


class Other(actors.Service, type_name="meeting/srv/Other"):
    class Request(actors.Message):
        a: int = 0

    class Response(actors.Message):
        b: int = 0


async def test_a_refused_client_does_not_wait(tmp_path: Path) -> None:
    """Without the right to call, waits for the service end at once with the broker's reason, as calls do."""
    rules = tmp_path / "access.toml"
    rules.write_text(
        '[local]\nuser = "guest"\n[users.guest]\nroles = ["guest"]\n[roles.guest]\nallow.node = ["/**"]\n'
    )
    async with (
        Broker(BrokerOptions(port=0, auth=rules)) as broker,
        actors.Node("guest", url=broker.url, use_global_arguments=False) as node,
    ):
        client = node.create_client(AddTwoInts, "add")
        parameters = actors.ParameterClient(node, "/other")
        for _ in range(2):  # while the declaration is on its way, and after it has been refused
            async with asyncio.timeout(DEADLINE_SEC):
                with pytest.raises(actors.ServiceUnavailable, match="do not allow 'guest' to call"):
                    await client.wait_for_service()
                with pytest.raises(actors.ServiceUnavailable, match="do not allow 'guest' to call"):
                    await client.call(ASK)
                with pytest.raises(actors.ServiceUnavailable, match="do not allow 'guest' to call"):
                    await parameters.wait_for_services()
