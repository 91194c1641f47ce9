"""Service calls through a real broker end, are distributed among servers, and do not deadlock."""

from __future__ import annotations

import asyncio
from collections import Counter
from typing import TYPE_CHECKING, TypeAlias

import pytest

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_srvs.srv import Trigger
from tests.integration.conftest import DEADLINE_SEC, NO_KEEPALIVE

if TYPE_CHECKING:
    import broker
    from tests.integration.conftest import System

Request: TypeAlias = AddTwoInts.Request
Response: TypeAlias = AddTwoInts.Response

SLOW_SERVER = """
import asyncio
import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts

class Slow(actors.Node):
    @actors.service(AddTwoInts, "add_two_ints")
    async def add(self, request):
        print("called", flush=True)
        try:
            await asyncio.sleep(3600)
        except asyncio.CancelledError:
            print("cancelled", flush=True)
            raise

actors.run(lambda: Slow("slow"))
"""


async def test_a_server_killed_during_a_call_fails_the_call_at_once(system: System) -> None:
    """SIGKILL while the handler runs: ServiceUnavailable neither by the deadline nor by the keepalive."""
    await system.broker(*NO_KEEPALIVE)
    server = await system.python("-c", SLOW_SERVER)
    async with actors.Node("client", url=system.url) as node:
        client = node.create_client(AddTwoInts, "add_two_ints")
        await client.wait_for_service()
        call = client.call_async(Request(a=1, b=2), timeout_sec=1000)
        await server.wait_for_line("called")
        await server.kill()
        with pytest.raises(actors.ServiceUnavailable, match="add_two_ints"):
            async with asyncio.timeout(DEADLINE_SEC):
                await call
        assert not client.service_is_ready()


async def test_the_client_example_reports_a_server_killed_during_a_call(system: System) -> None:
    """The client of the course prints the reason and exits with 1, without a traceback."""
    await system.broker()
    server = await system.python("-c", SLOW_SERVER)
    client = await system.example("add_two_ints_client", "5", "3")
    await server.wait_for_line("called")
    await server.kill()
    await client.wait_for_line("Failed to call service add_two_ints: ")
    assert await client.wait_for_exit() == 1
    assert "Traceback" not in client.output


async def test_a_killed_client_cancels_its_call(system: System) -> None:
    """The handler is cancelled when its caller is killed."""
    await system.broker()
    server = await system.python("-c", SLOW_SERVER)
    client = await system.example("add_two_ints_client", "5", "3")
    await server.wait_for_line("called")
    await client.kill()
    await server.wait_for_line("cancelled")


async def test_a_deadline_cancels_the_handler(system: System) -> None:
    """The caller gets ServiceTimeout, its handler CancelledError, and the server continues."""
    await system.broker()
    server = await system.python("-c", SLOW_SERVER)
    async with actors.Node("client", url=system.url) as node:
        client = node.create_client(AddTwoInts, "add_two_ints")
        await client.wait_for_service()
        for number in (1, 2):
            while server.lines.count("called") < number:  # the time may be over before the server begins
                with pytest.raises(actors.ServiceTimeout):
                    await client.call(Request(), timeout_sec=0.5)
            await server.wait_for_line("cancelled")
        assert client.pending == 0


async def test_a_call_without_a_server_fails_at_once(hub: broker.Broker) -> None:
    """ServiceUnavailable; only wait_for_service waits."""
    async with actors.Node("client", url=hub.url) as node:
        client = node.create_client(AddTwoInts, "nobody")
        await node.get_graph()
        with pytest.raises(actors.ServiceUnavailable):
            await client.call(Request())
        assert not await client.wait_for_service(timeout_sec=0)


async def test_an_overflowing_sum_is_an_error(hub: broker.Broker) -> None:
    """A reply that does not fit int64 reaches the caller as RemoteError; the next call succeeds."""
    async with actors.Node("both", url=hub.url) as node:
        node.create_service(AddTwoInts, "add", lambda request: Response(sum=request.a + request.b))
        client = node.create_client(AddTwoInts, "add")
        await client.wait_for_service()
        with pytest.raises(actors.RemoteError, match="sum"):
            await client.call(Request(a=2**63 - 1, b=1))
        assert (await client.call(Request(a=2**63 - 2, b=1))).sum == 2**63 - 1


async def test_calling_oneself_does_not_deadlock(hub: broker.Broker) -> None:
    """A handler may call a service of its own node, even the one it serves."""
    async with actors.Node("self", url=hub.url) as node:
        client = node.create_client(AddTwoInts, "countdown")

        async def countdown(request: Request) -> Response:
            if request.a == 0:
                return Response(sum=request.b)
            return await client.call(Request(a=request.a - 1, b=request.b + 1))

        node.create_service(AddTwoInts, "countdown", countdown)
        await client.wait_for_service()
        async with asyncio.timeout(DEADLINE_SEC):
            assert (await client.call(Request(a=20))).sum == 20


async def test_calling_in_a_circle_does_not_deadlock(hub: broker.Broker) -> None:
    """Three nodes whose handlers call each other in a circle, with several calls at the same time."""
    names = ("a", "b", "c")

    class Stage(actors.Node):
        def __init__(self, name: str, following: str) -> None:
            super().__init__(name, url=hub.url)
            self.following = self.create_client(AddTwoInts, following)
            self.create_service(AddTwoInts, name, self.on_request)

        async def on_request(self, request: Request) -> Response:
            if request.a == 0:
                return Response(sum=request.b)
            return await self.following.call(Request(a=request.a - 1, b=request.b + 1))

    stages = [Stage(name, names[(i + 1) % 3]) for i, name in enumerate(names)]
    async with stages[0], stages[1], stages[2], asyncio.timeout(DEADLINE_SEC):
        for stage in stages:
            await stage.following.wait_for_service()
        calls = [stage.following.call(Request(a=12)) for stage in stages for _ in range(4)]
        assert [response.sum for response in await asyncio.gather(*calls)] == [12] * 12


async def test_several_servers_share_the_requests(hub: broker.Broker) -> None:
    """Sequential requests rotate; simultaneous requests go to the server with the fewest pending."""
    answered: Counter[str] = Counter()
    slow = asyncio.Event()

    def server(name: str) -> actors.Node:
        async def handle(request: Trigger.Request) -> Trigger.Response:
            answered[name] += 1
            if name == "stuck":
                await slow.wait()
            return Trigger.Response(success=True, message=name)

        node = actors.Node(name, url=hub.url)
        node.create_service(Trigger, "work", handle)
        return node

    async with server("one"), server("two"), actors.Node("client", url=hub.url) as node:
        client = node.create_client(Trigger, "work")
        for name in ("/one", "/two"):
            await node.wait_for_node(name)
        for _ in range(10):
            await client.call(Trigger.Request())
        assert answered == {"one": 5, "two": 5}
        async with server("stuck"):
            await node.wait_for_node("/stuck")
            calls = [client.call_async(Trigger.Request()) for _ in range(30)]
            await asyncio.wait(calls, timeout=0.0)
            slow.set()
            await asyncio.gather(*calls)
        assert answered["stuck"] >= 8
        assert answered.total() == 40


async def test_another_type_on_the_same_service_is_no_match(system: System) -> None:
    """A client of another type sees no server, and both sides are warned with the names of the types."""
    await system.broker()
    server = await system.example("add_two_ints_server")
    await server.wait_for_line("Ready")
    async with actors.Node("client", url=system.url) as node:
        client = node.create_client(Trigger, "add_two_ints")
        warning = await server.wait_for_line("WARN")
        assert "add_two_ints" in warning
        assert "std_srvs/srv/Trigger" in warning
        with pytest.raises(actors.ServiceUnavailable):
            await client.call(Trigger.Request())
