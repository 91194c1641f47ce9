"""Services: what a handler may be, what it may return and raise, and what becomes of its calls."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.endpoints.endpoint import endpoint_of
from actors.interfaces.codec import codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Empty
from proto.wire.frames import RequestEntry
from tests.actors.meeting import MIB, Blow, stop_budget_clock, turns, until
from tests.seams.limits import set_limits
from tests.seams.nodes import context_of, invalid_requests, link_of

if TYPE_CHECKING:
    from pathlib import Path

    from actors.endpoints.service.service import ServiceServer
    from tests.actors.meeting import Meeting


def entry(call: int, a: int) -> RequestEntry:
    """Return a request as the broker sends it."""
    body = codec_for(AddTwoInts.Request).encode(AddTwoInts.Request(a=a))
    return RequestEntry(call, None, None, bytes(body))


@pytest.mark.parametrize("outcome", ["reply", "raise"])
async def test_a_call_whose_link_broke_is_never_answered_on_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, outcome: str
) -> None:
    """A handler that ends after its link broke must not answer a new call that has the same number."""
    set_limits(monkeypatch, first_retry_sec=3600)  # each failed attempt ends the session, too
    stop_budget_clock()
    finish, ended = asyncio.Event(), asyncio.Event()

    async def handle(request: AddTwoInts.Request) -> AddTwoInts.Response:
        try:
            await finish.wait()
        except asyncio.CancelledError:
            await finish.wait()
            ended.set()
            if outcome == "raise":
                raise ValueError("too late") from None
        return AddTwoInts.Response(sum=request.a)

    async with actors.Node("server", url=f"callboard+unix://{tmp_path}/none") as node:
        service = node.create_service(AddTwoInts, "add", handle, concurrent=True)
        endpoint_of(service).requested((entry(1, 10),))
        await asyncio.sleep(0)
        endpoint_of(service).session_ended()
        await asyncio.sleep(0)
        endpoint_of(service).requested((entry(1, 20),))
        await asyncio.sleep(0)
        assert service.pending == 1
        finish.set()
        await ended.wait()
        await asyncio.sleep(0)
        assert service.served == 1
        assert node.callback_errors == (outcome == "raise")


class Adder:
    """A server and a client of it, each a node of its own."""

    def __init__(self, server: actors.Node, caller: actors.Node) -> None:
        self.server = server
        self.caller = caller
        self.client = caller.create_client(AddTwoInts, "add")

    async def serve(self, callback: Any, **options: Any) -> ServiceServer[Any, Any]:
        service = self.server.create_service(AddTwoInts, "add", callback, **options)
        assert await self.client.wait_for_service(20)
        return service

    async def add(self, a: int = 1, b: int = 2, **options: Any) -> int:
        return (await self.client.call(AddTwoInts.Request(a=a, b=b), **options)).sum


@pytest.fixture
async def adder(meeting: Meeting) -> Adder:
    """A server node and a client node, connected."""
    return Adder(await meeting.node("server"), await meeting.node("caller"))


def one(request: AddTwoInts.Request) -> AddTwoInts.Response:
    return AddTwoInts.Response(sum=request.a + request.b)


def two(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
    response.sum = request.a + request.b
    return response


async def async_one(request: AddTwoInts.Request) -> AddTwoInts.Response:
    await asyncio.sleep(0)
    return one(request)


async def async_two(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
    await asyncio.sleep(0)
    return two(request, response)


def later(request: AddTwoInts.Request) -> asyncio.Future[AddTwoInts.Response]:
    loop = asyncio.get_running_loop()
    reply: asyncio.Future[AddTwoInts.Response] = loop.create_future()
    loop.call_soon(reply.set_result, one(request))
    return reply


@pytest.mark.parametrize("callback", [one, two, async_one, async_two, later])
@pytest.mark.parametrize("concurrent", [False, True])
async def test_every_form_of_handler_answers(adder: Adder, callback: Any, *, concurrent: bool) -> None:
    """(request) and (request, response), `def` and `async def`, with a future, concurrent or not."""
    service = await adder.serve(callback, concurrent=concurrent)
    assert await asyncio.gather(*(adder.add(i, 1) for i in range(20))) == list(range(1, 21))
    assert (service.served, service.pending, adder.client.pending) == (20, 0, 0)


def test_other_forms_are_refused() -> None:
    """A handler takes one or two arguments; a message class is no service."""
    node = actors.Node("server")
    with pytest.raises(RuntimeError, match="takes 1 or 2 arguments"):
        node.create_service(AddTwoInts, "add", lambda: None)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="no service type"):
        node.create_service(String, "add", one)  # type: ignore[arg-type]


@pytest.mark.parametrize("result", [None, String(), AddTwoInts.Request(), AddTwoInts.Response(sum="x")])  # type: ignore[arg-type]
@pytest.mark.parametrize("kind", ["def", "async def"])
async def test_a_handler_must_return_a_valid_response(
    adder: Adder, caplog: pytest.LogCaptureFixture, kind: str, result: Any
) -> None:
    """A wrong response is an error at the server, counted, and a RemoteError at the caller."""

    def plain(request: AddTwoInts.Request) -> Any:
        return result if request.a else AddTwoInts.Response(sum=5)

    async def slow(request: AddTwoInts.Request) -> Any:
        return plain(request)

    await adder.serve(plain if kind == "def" else slow)
    with pytest.raises(actors.RemoteError) as caught:
        await adder.add()
    assert caught.value.type_name in {"TypeError", "InvalidMessageError"}
    assert adder.server.callback_errors == 1
    assert "did not return a valid example_interfaces/srv/AddTwoInts_Response" in caplog.text
    assert (result is None) == ("the handler returned None: end it with `return response`" in caplog.text)
    assert await adder.add(0) == 5


@pytest.mark.parametrize("kind", ["def", "async def"])
@pytest.mark.parametrize("error", [ZeroDivisionError, asyncio.CancelledError])
async def test_a_raising_handler_is_a_remote_error(
    adder: Adder, caplog: pytest.LogCaptureFixture, kind: str, error: type[BaseException]
) -> None:
    """What a handler raises reaches the caller with type and text, is logged, counted, and harms nobody."""

    def plain(request: AddTwoInts.Request) -> AddTwoInts.Response:
        if request.a:
            raise error("so bad")
        return AddTwoInts.Response(sum=5)

    async def slow(request: AddTwoInts.Request) -> AddTwoInts.Response:
        return plain(request)

    await adder.serve(plain if kind == "def" else slow)
    with pytest.raises(actors.RemoteError, match="so bad") as caught:
        await adder.add()
    assert (caught.value.type_name, caught.value.text) == (error.__name__, "so bad")
    assert adder.server.callback_errors == 1
    assert "service '/add'" in caplog.text
    assert await adder.add(0) == 5
    assert link_of(adder.server).connections == 1


class Odd(BaseException):
    """No Exception, and none of those that end a program."""


class MuteError(Exception):
    """An exception that cannot say what it is."""

    def __str__(self) -> str:
        raise ZeroDivisionError


@pytest.mark.parametrize("kind", ["def", "async def"])
@pytest.mark.parametrize(
    ("error", "text"),
    [
        (Odd("odd"), "odd"),
        (ExceptionGroup("many", [ValueError("a"), TypeError("b")]), "many (2 sub-exceptions)"),
        (BaseExceptionGroup("more", [Odd()]), "more (1 sub-exception)"),
        (MuteError(), "(an exception without a readable text)"),
        (ValueError("x" * 100_000), "x" * 500),
    ],
)
async def test_whatever_a_handler_raises_reaches_its_caller(
    adder: Adder, kind: str, error: BaseException, text: str
) -> None:
    """Unusual exceptions are RemoteErrors with type and text, too, counted, and end neither node nor link."""

    def plain(request: AddTwoInts.Request) -> AddTwoInts.Response:
        if request.a:
            raise error
        return AddTwoInts.Response(sum=5)

    async def slow(request: AddTwoInts.Request) -> AddTwoInts.Response:
        await asyncio.sleep(0)
        return plain(request)

    await adder.serve(plain if kind == "def" else slow)
    with pytest.raises(actors.RemoteError) as caught:
        await adder.add()
    assert (caught.value.type_name, caught.value.text) == (type(error).__name__, text)
    assert adder.server.callback_errors == 1
    assert await adder.add(0) == 5
    assert link_of(adder.server).connections == 1


async def test_an_invalid_request_is_refused(adder: Adder) -> None:
    """A request that does not decode at the server is a RemoteError; the handler does not see it."""
    service = await adder.serve(one)
    with invalid_requests(adder.client), pytest.raises(actors.RemoteError) as caught:
        await adder.add()
    assert caught.value.type_name == "InvalidMessageError"
    assert service.pending == 0
    assert adder.server.callback_errors == 0


async def test_handlers_run_one_at_a_time_unless_concurrent(adder: Adder) -> None:
    """Three requests meet at a barrier of three only when the service is concurrent."""
    barrier = asyncio.Barrier(3)
    inside = most = 0

    async def meet(request: AddTwoInts.Request) -> AddTwoInts.Response:
        await barrier.wait()
        return one(request)

    async def alone(request: AddTwoInts.Request) -> AddTwoInts.Response:
        nonlocal inside, most
        inside += 1
        most = max(most, inside)
        await turns()
        inside -= 1
        return one(request)

    service = await adder.serve(meet, concurrent=True)
    assert await asyncio.gather(*(adder.add(i, 1) for i in range(3))) == [1, 2, 3]
    service.destroy()
    await until(lambda: not adder.client.service_is_ready())
    await adder.serve(alone)
    assert await asyncio.gather(*(adder.add(i, 1) for i in range(3))) == [1, 2, 3]
    assert most == 1


@pytest.mark.parametrize("kind", ["def", "async def"])
async def test_a_concurrent_service_answers_while_another_callback_is_suspended(
    adder: Adder, kind: str
) -> None:
    """A coroutine callback of the node that waits for anything does not hold it up, as it does others."""
    entered, gate = asyncio.Event(), asyncio.Event()

    async def hold() -> None:
        timer.cancel()
        entered.set()
        await gate.wait()

    async def later(request: AddTwoInts.Request) -> AddTwoInts.Response:
        await turns()
        return one(request)

    timer = adder.server.create_timer(0.001, hold)
    adder.server.create_service(Empty, "other", lambda request: Empty.Response())
    other = adder.caller.create_client(Empty, "other")
    await adder.serve(one if kind == "def" else later, concurrent=True)
    await other.wait_for_service()
    await entered.wait()
    call = other.call_async(Empty.Request())
    assert await asyncio.gather(*(adder.add(i, 1) for i in range(3))) == [1, 2, 3]
    assert not call.done()
    gate.set()
    await call


async def test_the_future_of_a_handler_ends_as_the_handler_would(adder: Adder) -> None:
    """Its error reaches the caller; it is cancelled by a caller that gives up, and with its service."""
    futures: list[asyncio.Future[AddTwoInts.Response]] = []

    def endless(request: AddTwoInts.Request) -> asyncio.Future[AddTwoInts.Response]:
        futures.append(asyncio.get_running_loop().create_future())
        return futures[-1]

    service = await adder.serve(endless, concurrent=True)
    failing, given_up, destroyed = (asyncio.ensure_future(adder.add()) for _ in range(3))
    await until(lambda: len(futures) == 3)
    assert (service.pending, endpoint_of(service).diagnostics().running) == (3, 3)
    futures[0].set_exception(ValueError("no sum"))
    with pytest.raises(actors.RemoteError, match="no sum"):
        await failing
    given_up.cancel()
    await until(futures[1].cancelled)
    adder.server.destroy_service(service)
    with pytest.raises(actors.ServiceUnavailable):
        await destroyed
    assert futures[2].cancelled()
    await turns()
    assert (service.pending, endpoint_of(service).diagnostics().running) == (0, 0)
    assert adder.server.callback_errors == 1


async def test_the_future_of_another_loop_is_an_error_of_the_handler(adder: Adder) -> None:
    """The thread of that loop would answer the call, beside this one."""
    other = asyncio.new_event_loop()
    foreign: asyncio.Future[AddTwoInts.Response] = other.create_future()

    def answer(_request: AddTwoInts.Request) -> asyncio.Future[AddTwoInts.Response]:
        return foreign

    await adder.serve(answer, concurrent=True)
    with pytest.raises(actors.RemoteError, match="attached to a different loop"):
        await adder.add()
    assert adder.server.callback_errors == 1
    other.close()


async def test_a_stopping_node_waits_for_the_future_of_a_handler(adder: Adder, meeting: Meeting) -> None:
    """The reply still reaches the caller; a future that is never done is cancelled after the time limit."""
    futures: list[asyncio.Future[AddTwoInts.Response]] = []

    def endless(request: AddTwoInts.Request) -> asyncio.Future[AddTwoInts.Response]:
        futures.append(asyncio.get_running_loop().create_future())
        return futures[-1]

    async with actors.Node("leaving", url=meeting.url, stop_timeout_sec=0.1) as leaving:
        leaving.create_service(AddTwoInts, "add", endless, concurrent=True)
        assert await adder.client.wait_for_service(20)
        answered, cancelled = asyncio.ensure_future(adder.add()), asyncio.ensure_future(adder.add())
        await until(lambda: len(futures) == 2)
        futures[0].set_result(AddTwoInts.Response(sum=3))  # the service hears of it in the next loop turn
    assert await answered == 3
    with pytest.raises(actors.ServiceUnavailable):
        await cancelled
    assert futures[1].cancelled()


async def test_a_destroyed_service_fails_its_callers(adder: Adder) -> None:
    """Handlers are cancelled, waiting requests and running ones fail; twice is no error."""
    entered, cancelled = asyncio.Event(), asyncio.Event()

    async def endless(request: AddTwoInts.Request) -> AddTwoInts.Response:
        entered.set()
        try:
            await asyncio.Event().wait()
        finally:
            cancelled.set()
        raise AssertionError

    service = await adder.serve(endless)
    calls = [asyncio.ensure_future(adder.add()) for _ in range(3)]
    await until(lambda: service.pending == 3)
    await entered.wait()
    assert adder.server.destroy_service(service)
    assert not adder.server.destroy_service(service)
    await cancelled.wait()
    for call in calls:
        with pytest.raises(actors.ServiceUnavailable):
            await call
    assert adder.server.callback_errors == 0


async def test_replies_made_before_a_service_is_destroyed_arrive(meeting: Meeting) -> None:
    """The broker hears of the end behind them, not before; the calls that are left fail."""
    node = await meeting.node("server")
    served: list[int] = []

    def handle(request: AddTwoInts.Request) -> AddTwoInts.Response:
        served.append(request.a)
        if len(served) == 50:
            service.destroy()
        return AddTwoInts.Response(sum=request.a)

    service = node.create_service(AddTwoInts, "add", handle)
    caller = await meeting.node("caller")
    client = caller.create_client(AddTwoInts, "add")
    assert await client.wait_for_service(20)
    calls = [client.call_async(AddTwoInts.Request(a=number)) for number in range(60)]
    async with asyncio.timeout(20):
        ended = await asyncio.gather(*calls, return_exceptions=True)
    sums = [reply.sum for reply in ended if isinstance(reply, AddTwoInts.Response)]
    assert sums == list(range(49))
    assert all(isinstance(error, actors.ServiceUnavailable) for error in ended[49:])


async def test_large_replies_made_before_a_service_is_destroyed_arrive(meeting: Meeting) -> None:
    """The broker hears of the end behind the last of their fragments, whichever of them ends last."""
    server, caller = await meeting.node("server"), await meeting.node("caller")
    sizes = [5 * MIB, 300_000, 1, MIB]

    def handle(request: Blow.Request) -> Blow.Response:
        if not request.size:
            service.destroy()
        return Blow.Response(data=bytes(request.size))

    service = server.create_service(Blow, "blow", handle)
    client = caller.create_client(Blow, "blow")
    assert await client.wait_for_service(20)
    calls = [client.call_async(Blow.Request(size=size)) for size in (*sizes, 0)]
    async with asyncio.timeout(20):
        *replies, last = await asyncio.gather(*calls, return_exceptions=True)
    assert [len(reply.data) for reply in replies if isinstance(reply, Blow.Response)] == sizes
    assert isinstance(last, actors.ServiceUnavailable)
    assert link_of(server).sent


async def test_a_node_that_stops_sends_its_large_replies_whole(meeting: Meeting) -> None:
    """Those that wait, and that of a handler that still runs: the node leaves behind it."""
    caller = await meeting.node("caller")
    server = meeting.absent("server")
    begun = asyncio.Event()

    async def handle(request: Blow.Request) -> Blow.Response:
        if request.size == MIB:
            begun.set()
            await until(lambda: context_of(server).stopping)
        return Blow.Response(data=bytes(request.size))

    sizes = [5 * MIB, 300_000, MIB]
    async with server:
        server.create_service(Blow, "blow", handle, concurrent=True)
        client = caller.create_client(Blow, "blow")
        assert await client.wait_for_service(20)
        calls = [client.call_async(Blow.Request(size=size)) for size in sizes]
        await begun.wait()
    async with asyncio.timeout(20):
        assert [len((await call).data) for call in calls] == sizes


async def test_a_node_may_be_destroyed_in_its_handler(meeting: Meeting) -> None:
    """`run` returns cleanly, and the caller gets an error instead of waiting for ever."""
    caller = await meeting.node("caller")
    server = meeting.absent("server")

    async def handle(request: AddTwoInts.Request) -> AddTwoInts.Response:
        server.destroy_node()
        await asyncio.Event().wait()
        raise AssertionError

    server.create_service(AddTwoInts, "add", handle)
    client = caller.create_client(AddTwoInts, "add")
    running = asyncio.create_task(server.run())
    assert await client.wait_for_service(20)
    with pytest.raises(actors.ServiceUnavailable):
        await client.call(AddTwoInts.Request())
    await running
    assert server.callback_errors == 0


async def test_a_node_without_a_broker_stops_with_a_handler_that_runs(tmp_path: Path) -> None:
    """A node stops although a handler is suspended, without a broker too."""
    ended = asyncio.Event()

    async def endless(request: AddTwoInts.Request) -> AddTwoInts.Response:
        try:
            await asyncio.Event().wait()
        finally:
            ended.set()
        raise AssertionError

    async with asyncio.timeout(20):
        url = f"callboard+unix://{tmp_path}/none"
        async with actors.Node("server", url=url, stop_timeout_sec=0.1) as node:
            service = node.create_service(AddTwoInts, "add", endless)
            endpoint_of(service).requested((entry(1, 10), entry(2, 20)))
            await turns()
    assert ended.is_set()


async def test_more_requests_than_may_wait_are_refused(adder: Adder, monkeypatch: pytest.MonkeyPatch) -> None:
    """The surplus is ServiceOverloaded at once and never handled; what waits is answered."""
    set_limits(monkeypatch, queued_requests=3)
    leave = asyncio.Event()
    handled: list[int] = []

    async def wait(request: AddTwoInts.Request) -> AddTwoInts.Response:
        handled.append(request.a)
        await leave.wait()
        return one(request)

    service = await adder.serve(wait)
    first = asyncio.ensure_future(adder.add(0, 1))
    await until(lambda: handled == [0])
    calls = [asyncio.ensure_future(adder.add(number, 1)) for number in range(1, 6)]
    for surplus in calls[3:]:
        with pytest.raises(actors.ServiceOverloaded, match="3 requests wait already"):
            await surplus
    assert service.pending == 4
    leave.set()
    assert await asyncio.gather(first, *calls[:3]) == [1, 2, 3, 4]
    assert handled == [0, 1, 2, 3]


async def test_abandoned_handlers_count_until_they_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Handlers that ignore their cancellation keep to the limit over sessions, and are shown."""
    set_limits(monkeypatch, running_requests=2, first_retry_sec=3600)
    stop_budget_clock()
    finish = asyncio.Event()
    handled: list[int] = []

    async def stubborn(request: AddTwoInts.Request) -> AddTwoInts.Response:
        handled.append(request.a)
        while not finish.is_set():
            try:
                await finish.wait()
            except asyncio.CancelledError:
                continue
        return AddTwoInts.Response()

    async with actors.Node("server", url=f"callboard+unix://{tmp_path}/none") as node:
        service = node.create_service(AddTwoInts, "add", stubborn, concurrent=True)
        try:
            for session in range(3):
                endpoint_of(service).requested(
                    tuple(entry(call, 10 * session + call) for call in range(1, 4))
                )
                await turns()
                assert handled == [1, 2]
                assert endpoint_of(service).diagnostics().running == 2
                if session < 2:
                    endpoint_of(service).session_ended()
                    await turns()
        finally:
            finish.set()
        await turns(20)
        assert handled == [1, 2, 21, 22, 23]
        assert endpoint_of(service).diagnostics().running == 0


async def test_several_servers_share(meeting: Meeting, adder: Adder) -> None:
    """Requests go to the server with the fewest that wait."""
    await adder.serve(async_one)
    second = await meeting.node("second")
    other = second.create_service(AddTwoInts, "add", async_one)
    await meeting.settled(second, adder.caller)
    await asyncio.gather(*(adder.add(i) for i in range(40)))
    assert 10 <= other.served <= 30


async def test_a_reply_over_the_limit_is_an_error_of_that_call_alone(meeting: Meeting) -> None:
    """A response that the broker would not take is a RemoteError; server and link go on."""
    await meeting.restart_broker(max_message_bytes=MIB)
    server, caller = await meeting.node("server"), await meeting.node("caller")

    def handle(request: Blow.Request) -> Blow.Response:
        return Blow.Response(data=bytes(request.size))

    server.create_service(Blow, "blow", handle)
    client = caller.create_client(Blow, "blow")
    assert await client.wait_for_service(20)
    with pytest.raises(actors.RemoteError, match="over the limit"):
        await client.call(Blow.Request(size=MIB))
    assert len((await client.call(Blow.Request(size=MIB - 500))).data) == MIB - 500
    with pytest.raises(InvalidMessageError, match="over the limit"):
        await client.call(Blow.Request(data=bytes(MIB)))
    assert client.pending == 0
    assert link_of(server).connections == link_of(caller).connections == 1


@pytest.mark.parametrize("size", [MIB, 5 * MIB])
async def test_large_requests_and_replies_arrive(meeting: Meeting, size: int) -> None:
    """Some MiB each way, with small calls beside them."""
    server, caller = await meeting.node("server"), await meeting.node("caller")

    def handle(request: Blow.Request) -> Blow.Response:
        return Blow.Response(data=request.data)

    server.create_service(Blow, "blow", handle)
    client = caller.create_client(Blow, "blow")
    assert await client.wait_for_service(20)
    sizes = [1, size, 2, size, 3]
    replies = await asyncio.gather(*(client.call(Blow.Request(data=b"x" * count)) for count in sizes))
    assert [len(reply.data) for reply in replies] == sizes
