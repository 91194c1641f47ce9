"""add_two_ints: a server, and a requester that keeps some calls in flight."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Any, Final

import actors
from actors.bench.roles.parent import Load
from actors.interfaces.example_interfaces.srv import AddTwoInts

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from actors.bench.roles.parent import Parent

SERVICE: Final = "bench_add"
WARM_UP_CALLS: Final = 200
WAIT_S: Final = 30.0


async def server(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Add until the parent lets go."""

    def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)

    async with actors.Node("bench_server", url=parameters["url"]) as node:
        service = node.create_service(AddTwoInts, SERVICE, add)
        await node.get_graph()  # behind our declarations: the service is there
        await parent.told_to_go()
        load = Load()
        await parent.gone()
        return load.figures(service.served, served=service.served)


async def requester(parameters: Mapping[str, Any], parent: Parent) -> dict[str, float]:
    """Keep `in_flight` calls in flight for `seconds`; check every sum."""
    times_s: list[float] = []
    async with actors.Node("bench_requester", url=parameters["url"]) as node:
        client = node.create_client(AddTwoInts, SERVICE)

        async def call(number: int) -> None:
            response = await client.call(AddTwoInts.Request(a=number, b=3))
            if response.sum != number + 3:
                raise RuntimeError(f"{number} + 3 is not {response.sum}")

        async def call_in_turn(stop: float) -> None:
            while (began := time.perf_counter()) < stop:
                await call(len(times_s))
                times_s.append(time.perf_counter() - began)

        await parent.told_to_go()
        if not await client.wait_for_service(WAIT_S):
            raise RuntimeError("the server is not there")
        for number in range(WARM_UP_CALLS):
            await call(number)
        load = Load()
        stop = time.perf_counter() + parameters["seconds"]
        async with asyncio.TaskGroup() as group:
            for _ in range(parameters["in_flight"]):
                group.create_task(call_in_turn(stop))
        elapsed_s = load.elapsed_s
        calls = len(times_s)
        rate = calls / elapsed_s
        return load.figures(calls, calls=calls, elapsed_s=elapsed_s, rate=rate, **percentiles_us(times_s))


def percentiles_us(times_s: Sequence[float]) -> dict[str, float]:
    """Return the median, the 99th and the 99.9th percentile, in us."""
    ordered = sorted(times_s)
    marks = {"p50_us": 0.5, "p99_us": 0.99, "p999_us": 0.999}
    return {name: 1e6 * ordered[int(mark * (len(ordered) - 1))] for name, mark in marks.items()}
