"""add_two_ints: a server, and a requester that keeps some calls in flight, on one service or many in turn."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Any, Final

import actors
from actors.cli.bench.roles import percentiles_us
from actors.interfaces.example_interfaces.srv import AddTwoInts
from benchmarks.harness.roles.parent import Load

if TYPE_CHECKING:
    from collections.abc import Mapping

    from benchmarks.harness.roles.parent import Parent

SERVICE: Final = "bench_add"
WARM_UP_CALLS: Final = 200
WAIT_S: Final = 30.0


async def server(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Add until the parent lets go."""

    def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)

    async with actors.Node("bench_server", url=parameters["url"]) as node:
        services = [node.create_service(AddTwoInts, name, add) for name in _names(parameters)]
        await node.get_graph()  # behind our declarations: the service is there
        await parent.ready()
        load = Load()
        await parent.gone()
        served = sum(service.served for service in services)
        return load.figures(served, served=served)


async def requester(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Keep `in_flight` calls in flight for `seconds`; check every sum."""
    times_s: list[float] = []
    calls = 0
    async with actors.Node("bench_requester", url=parameters["url"]) as node:
        clients = [node.create_client(AddTwoInts, name) for name in _names(parameters)]

        async def call(number: int) -> None:
            client = clients[number % len(clients)]
            response = await client.call(AddTwoInts.Request(a=number, b=3))
            if response.sum != number + 3:
                raise RuntimeError(f"{number} + 3 is not {response.sum}")

        async def call_services(stop: float) -> None:
            nonlocal calls
            while (began := time.perf_counter()) < stop:
                calls += 1
                await call(calls)
                times_s.append(time.perf_counter() - began)

        await parent.ready()
        for client in clients:
            if not await client.wait_for_service(WAIT_S):
                raise RuntimeError(f"nobody serves {client.srv_name}")
        for number in range(WARM_UP_CALLS):
            await call(number)
        load = Load()
        stop = time.perf_counter() + parameters["seconds"]
        async with asyncio.TaskGroup() as group:
            for _ in range(parameters["in_flight"]):
                group.create_task(call_services(stop))
        elapsed_s = load.elapsed_s
        rate = calls / elapsed_s
        return load.figures(calls, calls=calls, elapsed_s=elapsed_s, rate=rate, **percentiles_us(times_s))


def _names(parameters: Mapping[str, Any]) -> list[str]:
    return [f"{SERVICE}_{number}" for number in range(parameters.get("services", 1))]
