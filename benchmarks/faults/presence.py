"""How soon a caller hears of a server's death, and a waiting client of a server's birth.

Each round is one server process: a client waits for it, calls it, and the server is killed with SIGKILL while
its handler runs. Times are of CLOCK_MONOTONIC, which is one for all processes of a machine.
"""

from __future__ import annotations

import time
from asyncio import create_task
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from benchmarks.faults.figures import Section, milliseconds
from benchmarks.faults.puppet import Theatre, TrialError, cores

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

SERVICE = "faults_add"

TYPICAL_MS = 50
"""The median time in which a caller hears of a death."""
LONGEST_MS = 250
"""The same at worst, on a busy machine, too."""


@dataclass
class Rounds:
    """Times in seconds, one of each for every round."""

    errors: list[float] = field(default_factory=list[float])
    """From SIGKILL to the caller's ServiceUnavailable."""
    waits: list[float] = field(default_factory=list[float])
    """From the server's `create_service` to the return of `wait_for_service`."""
    starts: list[float] = field(default_factory=list[float])
    """From the start of the server's process to the same."""


async def measure(rounds: int, *, busy: bool) -> Rounds:
    """Play so many rounds; `busy` keeps every core occupied meanwhile."""
    found = Rounds()
    async with Theatre() as theatre:
        await theatre.broker()
        if busy:
            await theatre.spin(cores())
        async with actors.Node("faults_watcher", url=theatre.url) as node:
            client = node.create_client(AddTwoInts, SERVICE)
            for _ in range(rounds):
                await _round(theatre, client, found)
                while client.service_is_ready():
                    await node.get_graph()
    return found


async def _round(theatre: Theatre, client: actors.Client[Any, Any], found: Rounds) -> None:
    waiting = create_task(_moment_of_service(client))
    started = time.monotonic()
    server = await theatre.play("server", service=SERVICE)
    declared = (await server.hears("declared"))["at"]
    returned = await waiting
    found.waits.append(returned - declared)
    found.starts.append(returned - started)
    call = client.call_async(AddTwoInts.Request(a=1, b=2))
    await server.hears("called")
    killed = time.monotonic()
    server.kill()
    try:
        await call
    except actors.ServiceUnavailable:
        found.errors.append(time.monotonic() - killed)
    else:
        raise TrialError("a dead server has answered")
    await theatre.end(server)


async def _moment_of_service(client: actors.Client[Any, Any]) -> float:
    await client.wait_for_service()
    return time.monotonic()


def presence_section(by_load: Mapping[str, Rounds]) -> Section:
    """Return the table of deaths; a failure if one was heard of too late."""
    figures = {load: milliseconds(found.errors) for load, found in by_load.items()}
    return Section(
        key="presence",
        title="a server is killed (SIGKILL) while it handles a call",
        text=(
            "From the signal to ServiceUnavailable at the caller, in ms."
            " Busy: with a spinning process on each core."
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
            yield f"{load}: a death was heard of after {took:.1f} ms ({what}), {limit} are allowed"


def wait_section(by_load: Mapping[str, Rounds]) -> Section:
    """Return the table of births."""
    figures: dict[str, dict[str, float]] = {}
    for load, found in by_load.items():
        figures[f"{load}, from create_service"] = milliseconds(found.waits)
        figures[f"{load}, from the process's start"] = milliseconds(found.starts)
    return Section(
        key="wait",
        title="a client waits for a service that appears",
        text=(
            "To the return of `wait_for_service`, in ms. Nearly all of a process's start is Python importing"
            " its modules."
        ),
        heading=["machine", "rounds", "p50", "p95", "max"],
        rows=[_row(load, found) for load, found in figures.items()],
        figures=figures,
    )


def _row(load: str, found: Mapping[str, float]) -> list[str]:
    times = [f"{found[key]:.1f}" for key in ("p50_ms", "p95_ms", "max_ms")]
    return [load, f"{found['count']:.0f}", *times]
