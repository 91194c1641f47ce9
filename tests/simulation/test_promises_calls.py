"""Promises about calls, each in the situation that tests it: they end once, and in time, at every peer."""

from __future__ import annotations

import asyncio
import math
from collections import Counter
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.endpoints.endpoint import endpoint_of
from proto import limits
from tests.seams import simulation as seams
from tests.seams.nodes import context_of, link_of
from tests.simulation.network import BROKER, on_host
from tests.simulation.records import Ask
from tests.simulation.stage import Stage, play

if TYPE_CHECKING:
    from actors.endpoints.service.service import ServiceServer

SOON_SEC = 0.1
"""What a message or two takes over the stage's network, with much to spare."""


class Desk:
    """A server whose handler takes as long as it is asked to, or until `leave`; it writes everything down."""

    def __init__(self, node: actors.Node, *, concurrent: bool = True) -> None:
        self.node = node
        self.leave = asyncio.Event()
        self.begun: Counter[int] = Counter()
        self.done: list[int] = []
        self.cancelled: list[int] = []
        self.service: ServiceServer[Any, Any] = node.create_service(
            Ask, "double", self.handle, concurrent=concurrent
        )

    async def handle(self, request: Ask.Request) -> Ask.Response:
        self.begun[request.number] += 1
        try:
            if request.seconds:
                await asyncio.sleep(request.seconds)
            else:
                await self.leave.wait()
        except asyncio.CancelledError:
            self.cancelled.append(request.number)
            raise
        self.done.append(request.number)
        return Ask.Response(number=2 * request.number)


async def desk_and_client(stage: Stage, *, concurrent: bool = True) -> tuple[Desk, actors.Client[Any, Any]]:
    """Bring up a server and a client of it, each on a host of its own."""
    desk = Desk(await stage.enter("server"), concurrent=concurrent)
    client = (await stage.enter("caller")).create_client(Ask, "double")
    assert await client.wait_for_service(5)
    return desk, client


def nothing_pends(stage: Stage, desk: Desk, client: actors.Client[Any, Any]) -> bool:
    """Whether client, broker and server have forgotten every call."""
    here = client.pending + seams.pending_deadlines(client)
    return not here + stage.broker.stats().pending_calls + desk.service.pending


@pytest.mark.parametrize("limit", [0, 0.25, 3.0])
def test_a_deadline_holds_to_the_moment(limit: float) -> None:
    """ServiceTimeout is raised exactly at the deadline; the handler is cancelled soon after."""

    async def scene(stage: Stage) -> None:
        desk, client = await desk_and_client(stage)
        began = stage.loop.time()
        with pytest.raises(actors.ServiceTimeout):
            await client.call(Ask.Request(), limit)
        assert stage.loop.time() - began == pytest.approx(limit, abs=1e-6)
        await stage.until(lambda: nothing_pends(stage, desk, client), SOON_SEC)
        assert len(desk.cancelled) == desk.begun.total()

    play(scene)


def test_a_call_without_a_deadline_waits_for_ever() -> None:
    """With `math.inf` a reply after half an hour still arrives."""

    async def scene(stage: Stage) -> None:
        _, client = await desk_and_client(stage)
        reply = await client.call(Ask.Request(number=4, seconds=1800), math.inf)
        assert reply.number == 8
        assert stage.loop.time() > 1800

    play(scene)


def test_replies_and_deadlines_may_cross() -> None:
    """A call ends once and in time; a reply after the deadline is counted and dropped."""

    async def scene(stage: Stage) -> None:
        desk, client = await desk_and_client(stage)
        outcomes: Counter[str] = Counter()
        for step in range(100):
            limit, began = 0.98 + step * 0.0004, stage.loop.time()
            try:
                reply = await client.call(Ask.Request(number=step, seconds=1), limit)
                assert reply.number == 2 * step
                outcomes["reply"] += 1
            except actors.ServiceTimeout:
                outcomes["timeout"] += 1
            assert stage.loop.time() - began <= limit + 1e-6
        await stage.until(lambda: nothing_pends(stage, desk, client), 2)
        assert outcomes["reply"]
        assert outcomes["timeout"]
        late = client.late + stage.broker.stats().late_replies
        # Each handler that finished for nobody has sent a reply that somebody has counted; those that were
        # cancelled have said so, which is late, too.
        assert late == outcomes["timeout"]

    play(scene)


def test_cancelling_reaches_requests_wherever_they_are() -> None:
    """In a handler, in the server's queue, in transit, and before it was sent."""

    async def scene(stage: Stage) -> None:
        desk, client = await desk_and_client(stage, concurrent=False)
        running = client.call_async(Ask.Request(number=1))
        await stage.until(lambda: desk.begun[1] == 1)
        queued = client.call_async(Ask.Request(number=2))
        await stage.until(lambda: desk.service.pending == 2)
        routed = stage.broker.stats().calls
        unsent = client.call_async(Ask.Request(number=3))
        unsent.cancel()
        await asyncio.sleep(1)
        assert stage.broker.stats().calls == routed
        queued.cancel()
        await stage.until(lambda: desk.service.pending == 1, SOON_SEC)
        on_its_way = client.call_async(Ask.Request(number=4))
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        on_its_way.cancel()
        running.cancel()
        await stage.until(lambda: nothing_pends(stage, desk, client), SOON_SEC)
        assert desk.cancelled == [1]
        assert set(desk.begun) <= {1, 4}
        desk.leave.set()
        assert (await client.call(Ask.Request(number=5))).number == 10

    play(scene)


@pytest.mark.parametrize("where", ["caller", "broker"])
def test_a_large_request_is_taken_back_half_way(where: str) -> None:
    """Its remaining fragments are not sent, the server does not see it, and the connections stay up."""

    async def scene(stage: Stage) -> None:
        desk, client = await desk_and_client(stage)
        stage.network.slow_down(BROKER if where == "caller" else "server", read=20_000, pause=0.05)
        call = client.call_async(Ask.Request(number=1, weight=bytes(10_000_000)), 60)
        await asyncio.sleep(3)
        channel = (endpoint_of(client).context if where == "caller" else context_of(desk.node)).link.channel
        assert channel is not None
        assert 500_000 < max(channel.bytes_sent, channel.bytes_received) < 5_000_000
        call.cancel()
        stage.network.heal()
        await stage.until(lambda: nothing_pends(stage, desk, client), 5)
        desk.leave.set()
        reply = await client.call(Ask.Request(number=2, weight=bytes(1_000_000)), 60)
        assert reply.number == 4
        assert set(desk.begun) == {2}
        assert endpoint_of(client).context.link.connections == link_of(desk.node).connections == 1

    play(scene)


@pytest.mark.parametrize(("silent", "limit"), [(False, SOON_SEC), (True, 5.0)])
def test_a_dead_server_fails_all_its_calls_at_once(*, silent: bool, limit: float) -> None:
    """A thousand calls in flight fail with ServiceUnavailable at the same time."""

    async def scene(stage: Stage) -> None:
        caller = await stage.enter("caller")
        client = caller.create_client(Ask, "double")
        dead = asyncio.Event()

        async def serve() -> None:
            async with actors.Node("server", use_global_arguments=False) as node:
                desks.append(Desk(node))
                await dead.wait()

        desks: list[Desk] = []
        with on_host("server"):
            server = asyncio.create_task(serve())
        assert await client.wait_for_service(5)
        calls = [client.call_async(Ask.Request(number=number), math.inf) for number in range(1000)]
        await stage.until(lambda: desks[0].begun.total() == 1000)
        stage.network.crash("server", silent=silent)
        began = stage.loop.time()
        ends = await asyncio.gather(*calls, return_exceptions=True)
        assert stage.loop.time() - began < limit
        assert {type(end) for end in ends} == {actors.ServiceUnavailable}
        assert client.pending == stage.broker.stats().pending_calls == 0
        dead.set()
        await server

    play(scene)


def test_a_slow_server_gets_fewer_calls() -> None:
    """The slowest of three servers gets what it can handle, and calls wait no longer than necessary."""

    async def scene(stage: Stage) -> None:
        served: Counter[str] = Counter()

        def handler(name: str, seconds: float) -> Any:
            async def handle(request: Ask.Request) -> Ask.Response:
                served[name] += 1
                await asyncio.sleep(seconds)
                return Ask.Response(number=2 * request.number)

            return handle

        for name, seconds in (("swift", 0.01), ("quick", 0.01), ("slow", 1.0)):
            node = await stage.enter(name)
            node.create_service(Ask, "double", handler(name, seconds), concurrent=True)
        client = (await stage.enter("caller")).create_client(Ask, "double")
        await stage.until(lambda: client.peers == 3)

        async def keep_asking() -> None:
            for number in range(100):
                assert (await client.call(Ask.Request(number=number))).number == 2 * number

        await asyncio.gather(*(keep_asking() for _ in range(6)))
        assert served.total() == 600
        assert served["slow"] < 60
        assert served["swift"] == pytest.approx(served["quick"], abs=60)

    play(scene)


def test_a_suspended_server_is_passed_over_and_informed_when_it_is_back() -> None:
    """Other servers take over; when it is back its handlers are cancelled and late replies dropped."""

    async def scene(stage: Stage) -> None:
        desk, client = await desk_and_client(stage)
        calls = [client.call_async(Ask.Request(number=number), math.inf) for number in range(10)]
        finishing = client.call_async(Ask.Request(number=10, seconds=4), math.inf)
        await stage.until(lambda: desk.begun.total() == 11)
        other = await stage.enter("other")
        other.create_service(Ask, "double", lambda request: Ask.Response(number=2 * request.number))
        await stage.until(lambda: client.peers == 2)
        stage.network.partition("server")
        began = stage.loop.time()
        for call in (*calls, finishing):
            with pytest.raises(actors.ServiceUnavailable):
                await call
        assert stage.loop.time() - began < 5
        assert (await client.call(Ask.Request(number=50))).number == 100
        stage.network.heal()
        await stage.until(lambda: client.peers == 2, 10)
        await stage.until(lambda: nothing_pends(stage, desk, client), 2)
        assert sorted(desk.cancelled) == sorted({*range(11)} - {*desk.done})
        assert all(count == 1 for count in desk.begun.values())
        desk.leave.set()
        assert (await client.call(Ask.Request(number=51))).number == 102

    play(scene)


@pytest.mark.long
def test_many_calls_wait_and_end(pytestconfig: pytest.Config) -> None:
    """All calls of one client at one server are answered, and nothing remains of them.

    `make nightly` makes a hundred thousand.
    """
    count = 100_000 if pytestconfig.getoption("--nightly") else 10_000

    async def scene(stage: Stage) -> None:
        desk, client = await desk_and_client(stage, concurrent=False)
        calls = [client.call_async(Ask.Request(number=number), 1000) for number in range(count)]
        await stage.until(lambda: desk.service.pending == count, 60)
        assert client.pending == stage.broker.stats().pending_calls == count
        desk.leave.set()
        async with asyncio.timeout(500):
            for number, call in enumerate(calls):
                assert (await call).number == 2 * number
        assert nothing_pends(stage, desk, client)
        assert desk.begun.total() == len(desk.begun) == count
        assert seams.kept_deadlines(client) < 3000

    play(scene)


@pytest.mark.parametrize("way", ["destroy the service", "stop", "stop in the midst"])
def test_a_server_that_leaves_has_its_large_replies_sent(way: str) -> None:
    """On a slow link callers get all its replies, and new calls do not wait behind them."""
    sizes = [3_000_000, 300_000, 1, 900_000, limits.MAX_FRAME_BYTES]

    async def handle(request: Ask.Request) -> Ask.Response:
        if way == "stop in the midst":
            await asyncio.sleep(0.2)
        return Ask.Response(number=request.number, weight=bytes(sizes[request.number]))

    async def scene(stage: Stage) -> None:
        client = (await stage.enter("caller")).create_client(Ask, "double")
        async with AsyncExitStack() as stack:
            with on_host("server"):
                server = actors.Node("server", use_global_arguments=False)
                await stack.enter_async_context(server)
            service = server.create_service(Ask, "double", handle, concurrent=True)
            assert await client.wait_for_service(5)
            other = await stage.enter("other")
            stage.network.slow_down(BROKER, read=64 * 1024, pause=0.01)
            calls = [client.call_async(Ask.Request(number=number)) for number in range(len(sizes))]
            await stage.until(lambda: service.pending == len(sizes) or service.served == len(sizes))
            other.create_service(Ask, "double", lambda request: Ask.Response(number=2 * request.number))
            await stage.until(lambda: client.peers == 2)
            if way == "destroy the service":
                await stage.until(lambda: service.served == len(sizes))
                assert server.destroy_service(service)
                await stage.until(lambda: client.peers == 1, SOON_SEC)
                assert (await client.call(Ask.Request(number=50))).number == 100
                assert not all(call.done() for call in calls)
                await asyncio.wait(calls)
        assert [len((await call).weight) for call in calls] == sizes
        assert (await client.call(Ask.Request(number=51))).number == 102

    play(scene)


@pytest.mark.parametrize("blocked", [False, True])
def test_a_destroyed_client_leaves_nothing_of_its_large_requests(*, blocked: bool) -> None:
    """Unsent ones are not sent; the connection and other calls continue."""

    async def scene(stage: Stage) -> None:
        desk, client = await desk_and_client(stage)
        desk.leave.set()
        if blocked:
            stage.network.block("caller", BROKER)
        calls = [client.call_async(Ask.Request(weight=bytes(2_000_000)), math.inf) for _ in range(5)]
        await asyncio.sleep(0.002)
        link = endpoint_of(client).context.link
        client.destroy()
        assert all(isinstance(call.exception(), actors.NodeDestroyed) for call in calls)
        assert link.channel is not None
        assert link.channel.outbox.bulk_bytes == 0
        stage.network.heal()
        await stage.until(lambda: nothing_pends(stage, desk, client), 5)
        assert link.connections == 1

    play(scene)


def test_a_failed_call_is_not_tried_again() -> None:
    """Each call is handled at most once, and never repeated automatically."""

    async def scene(stage: Stage) -> None:
        desk, client = await desk_and_client(stage)
        for attempt, strike in enumerate(("broker", "server", "caller")):
            calls = [
                client.call_async(Ask.Request(number=100 * attempt + number), math.inf)
                for number in range(50)
            ]
            await asyncio.sleep(0.0001 if strike == "server" else 0.5)
            if strike == "broker":
                await stage.crash_broker()
            else:
                stage.network.drop(strike)
            ends = await asyncio.gather(*calls, return_exceptions=True)
            assert {type(end) for end in ends} == {actors.ServiceUnavailable}
            if strike == "broker":
                await stage.start_broker()
            assert await client.wait_for_service(20)
            await asyncio.sleep(5)
        assert desk.begun.total() >= 50
        assert set(desk.begun.values()) == {1}
        assert nothing_pends(stage, desk, client)

    play(scene)


def test_a_link_that_takes_nothing_turns_calls_away() -> None:
    """Large calls queue up to a limit and are then refused at once; accepted ones continue."""

    async def scene(stage: Stage) -> None:
        desk, client = await desk_and_client(stage)
        desk.leave.set()
        stage.network.block("caller", BROKER)
        calls = []
        for number in range(100):
            calls.append(client.call_async(Ask.Request(number=number, weight=bytes(1_000_000)), math.inf))
            await asyncio.sleep(0)
        refused = [call for call in calls if call.done()]
        assert 30 < len(refused) < 40  # 64 MiB have been accepted
        for call in refused:
            with pytest.raises(actors.ServiceOverloaded, match="unsent bytes wait already"):
                await call
        stage.network.heal()
        accepted = [call for call in calls if call not in refused]
        assert [reply.number for reply in await asyncio.gather(*accepted)] == [
            2 * number for number in range(len(accepted))
        ]
        assert nothing_pends(stage, desk, client)

    play(scene)


def test_ten_thousand_cancellations_of_one_turn_leave_nothing() -> None:
    """Calls in the server's queue never start; running ones are cancelled."""

    async def scene(stage: Stage) -> None:
        desk, client = await desk_and_client(stage)
        calls = [client.call_async(Ask.Request(number=number), math.inf) for number in range(10_000)]
        await stage.until(lambda: desk.service.pending == 10_000)
        for call in calls:
            call.cancel()
        await stage.until(lambda: nothing_pends(stage, desk, client), 1)
        assert len(desk.cancelled) == desk.begun.total() == 1000
        desk.leave.set()
        assert (await client.call(Ask.Request(number=3))).number == 6

    play(scene)
