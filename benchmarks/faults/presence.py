"""How soon a caller notices that a server died, and a waiting client that a server started.

In each round a client waits for a new server process and calls it, and the server is killed with SIGKILL
while its handler runs. Times come from CLOCK_MONOTONIC, which all processes of a machine share.
"""

from __future__ import annotations

import time
from asyncio import create_task
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from benchmarks.faults.figures import Section, milliseconds
from benchmarks.faults.processes import ProcessGroup, TrialError, cores

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

SERVICE = "faults_add"

TYPICAL_MS = 50
"""Limit of the median time until a caller notices."""
LONGEST_MS = 250
"""Limit of the longest time, also on a busy machine."""


@dataclass
class Rounds:
    """Times in seconds, one of each per round."""

    errors: list[float] = field(default_factory=list[float])
    """From SIGKILL to the caller's ServiceUnavailable."""
    waits: list[float] = field(default_factory=list[float])
    """From the server's `create_service` to the return of `wait_for_service`."""
    starts: list[float] = field(default_factory=list[float])
    """From the start of the server's process to the return of `wait_for_service`."""


async def measure(rounds: int, *, busy: bool) -> Rounds:
    """Run `rounds` rounds; `busy` keeps every core occupied meanwhile."""
    found = Rounds()
    async with ProcessGroup() as processes:
        await processes.start_broker()
        if busy:
            await processes.load_cores(cores())
        async with actors.Node("faults_watcher", url=processes.url) as node:
            client = node.create_client(AddTwoInts, SERVICE)
            for _ in range(rounds):
                await _round(processes, client, found)
                while client.service_is_ready():
                    await node.get_graph()
    return found


async def _round(processes: ProcessGroup, client: actors.Client[Any, Any], found: Rounds) -> None:
    waiting = create_task(_moment_of_service(client))
    started = time.monotonic()
    server = await processes.start_role("server", service=SERVICE)
    declared = (await server.wait_for_event("declared"))["at"]
    returned = await waiting
    found.waits.append(returned - declared)
    found.starts.append(returned - started)
    call = client.call_async(AddTwoInts.Request(a=1, b=2))
    await server.wait_for_event("called")
    killed = time.monotonic()
    server.kill()
    try:
        await call
    except actors.ServiceUnavailable:
        found.errors.append(time.monotonic() - killed)
    else:
        raise TrialError("a dead server answered")
    await processes.stop(server)


async def _moment_of_service(client: actors.Client[Any, Any]) -> float:
    await client.wait_for_service()
    return time.monotonic()


def presence_section(by_load: Mapping[str, Rounds]) -> Section:
    """Return the table of deaths; one that is noticed too late is a failure."""
    figures = {load: milliseconds(found.errors) for load, found in by_load.items()}
    return Section(
        key="presence",
        title="a server is killed (SIGKILL) while it handles a call",
        text=(
            "Time from the signal until the caller gets ServiceUnavailable, in ms."
            " Busy: with a busy loop on each core."
        ),
        heading=["machine", "rounds", "p50", "p95", "max"],
        rows=[_row(load, found) for load, found in figures.items()],
        figures=figures,
        failures=[failure for load, found in figures.items() for failure in _late(load, found)],
    )


def _late(load: str, found: Mapping[str, float]) -> Iterator[str]:
    for what, limit in (("p50", TYPICAL_MS), ("max", LONGEST_MS)):
        took = found[f"{what}_ms"]
        if took > limit:
            yield f"{load}: a death was noticed after {took:.1f} ms ({what}), the limit is {limit}"


def wait_section(by_load: Mapping[str, Rounds]) -> Section:
    """Return the table of starts."""
    figures: dict[str, dict[str, float]] = {}
    for load, found in by_load.items():
        figures[f"{load}, from create_service"] = milliseconds(found.waits)
        figures[f"{load}, from the process's start"] = milliseconds(found.starts)
    return Section(
        key="wait",
        title="a client waits for a service that starts",
        text=(
            "Time until `wait_for_service` returns, in ms. Most of the time from a process's start is spent"
            " on Python imports."
        ),
        heading=["machine", "rounds", "p50", "p95", "max"],
        rows=[_row(load, found) for load, found in figures.items()],
        figures=figures,
    )


def _row(load: str, found: Mapping[str, float]) -> list[str]:
    times = [f"{found[key]:.1f}" for key in ("p50_ms", "p95_ms", "max_ms")]
    return [load, f"{found['count']:.0f}", *times]
