"""How soon a caller notices that a server is frozen (SIGSTOP), and that it is back (SIGCONT)."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from benchmarks.faults.figures import Section, milliseconds
from benchmarks.faults.presence import SERVICE
from benchmarks.faults.processes import ProcessGroup, TrialError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchmarks.faults.processes import ControlledProcess

KEEPALIVES_S = (0.6, 3.0)


@dataclass(kw_only=True)
class Rounds:
    """Times in seconds, one of each per round, under one keepalive limit."""

    keepalive_s: float
    errors: list[float] = field(default_factory=list[float])
    """From SIGSTOP to ServiceUnavailable of the call in progress."""
    returns: list[float] = field(default_factory=list[float])
    """From SIGCONT to the return of `wait_for_service`."""


async def measure(rounds: int, keepalives_s: Sequence[float] = KEEPALIVES_S) -> list[Rounds]:
    """Freeze and continue one server `rounds` times under each keepalive limit."""
    return [await _measure(rounds, keepalive_s) for keepalive_s in keepalives_s]


async def _measure(rounds: int, keepalive_s: float) -> Rounds:
    found = Rounds(keepalive_s=keepalive_s)
    async with ProcessGroup() as processes:
        await processes.start_broker("--keepalive-sec", str(keepalive_s))
        server = await processes.start_role("server", service=SERVICE)
        await server.wait_for_event("declared")
        async with actors.Node("faults_watcher", url=processes.url) as node:
            client = node.create_client(AddTwoInts, SERVICE)
            for _ in range(rounds):
                await client.wait_for_service()
                await _round(server, client, found)
    return found


async def _round(server: ControlledProcess, client: actors.Client[Any, Any], found: Rounds) -> None:
    call = client.call_async(AddTwoInts.Request(a=1, b=2))
    await server.wait_for_event("called")
    frozen = time.monotonic()
    os.kill(server.pid, signal.SIGSTOP)
    try:
        await call
    except actors.ServiceUnavailable:
        found.errors.append(time.monotonic() - frozen)
    else:
        raise TrialError("a frozen server answered")
    continued = time.monotonic()
    os.kill(server.pid, signal.SIGCONT)
    await client.wait_for_service()
    found.returns.append(time.monotonic() - continued)


def section(by_keepalive: Sequence[Rounds]) -> Section:
    """Return the table; a frozen server that is noticed too late is a failure."""
    rows: list[list[str]] = []
    figures: dict[str, Any] = {}
    failures: list[str] = []
    for found in by_keepalive:
        errors, returns = milliseconds(found.errors), milliseconds(found.returns)
        limit = f"{found.keepalive_s:g} s"
        rows.append(
            [
                limit,
                str(len(found.errors)),
                f"{errors['p50_ms'] / 1000:.2f} s",
                f"{errors['max_ms'] / 1000:.2f} s",
                f"{returns['p50_ms']:.1f} ms",
                f"{returns['max_ms']:.1f} ms",
            ]
        )
        figures[limit] = {"error": errors, "return": returns}
        if errors["max_ms"] > 2000 * found.keepalive_s:
            failures.append(f"with a keepalive of {limit} a frozen server was noticed too late")
    return Section(
        key="freeze",
        title="a server is frozen (SIGSTOP) while it handles a call, and continued (SIGCONT)",
        text=(
            "Time from SIGSTOP until the caller gets ServiceUnavailable, and from SIGCONT until"
            " `wait_for_service` returns. The broker checks for silence several times within the"
            " keepalive limit (`--keepalive-sec`)."
        ),
        heading=["keepalive", "rounds", "error, p50", "error, max", "back, p50", "back, max"],
        rows=rows,
        figures=figures,
        failures=failures,
    )
