"""One trial: one contender runs one case once, in new processes, and yields its figures."""

from __future__ import annotations

import asyncio
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Final

from benchmarks.harness import meters
from benchmarks.harness.errors import TrialError
from benchmarks.harness.outcomes import Outcome, Played
from benchmarks.harness.processes import TrialProcesses
from proto.aio.process import raise_file_limit

if TYPE_CHECKING:
    from benchmarks.harness.contender import Contender
    from benchmarks.harness.processes import RoleProcess
    from benchmarks.harness.workloads import Case, Part

DONE_TIMEOUT_S: Final = 60.0
"""Time after the load for consumers and their server to finish."""
PAUSE_S: Final = 3.0
"""Between the last idle connection and the start of the measurement."""
WINDOW_S: Final = 5.0
"""Length of the measurement."""
ENOUGH_FILES: Final = 65_536
SPARE_FILES: Final = 256
"""Descriptors that a process needs beside its connections."""


async def run_trial(contender: Contender, case: Case, seconds: float) -> dict[str, float]:
    """Run one trial and return its figures.

    Raises:
        TrialError: A process failed or hung, or messages were lost.
    """
    if case.connections:
        raise_file_limit(ENOUGH_FILES)  # before the server starts, which inherits it
    with TemporaryDirectory(prefix="bench-") as folder:
        async with TrialProcesses(contender, Path(folder)) as processes:
            play = _hold if case.connections else _load
            return case.measure(await play(processes, case, seconds))


def missing(contender: Contender, case: Case) -> list[str]:
    """Return the roles and abilities that a case needs and a contender does not have."""
    return sorted(({part.role for part in case.parts} | case.needs) - contender.roles)


async def _load(processes: TrialProcesses, case: Case, seconds: float) -> Outcome:
    """Start the roles; measure the server's CPU time until the last of them has ended."""
    playing: list[tuple[Part, RoleProcess]] = []
    for part in case.parts:
        process = await processes.add(part.role, {**part.parameters, "seconds": seconds})
        playing.append((part, process))
    before_s = _server_cpu_s(processes)
    for _, process in playing:
        await process.go()
    limit_s = seconds + DONE_TIMEOUT_S
    played = await _ends([each for each in playing if not each[0].held], limit_s)
    after_s = _server_cpu_s(processes)
    for part, process in reversed(playing):  # earlier roles may serve later ones
        if part.held:
            await process.release()
            played += await _ends([(part, process)], limit_s)
    used_s = None if before_s is None or after_s is None else after_s - before_s
    return Outcome(played=tuple(played), server_cpu_s=used_s)


async def _ends(playing: list[tuple[Part, RoleProcess]], limit_s: float) -> list[Played]:
    """Wait for all figures; the first failure fails the trial."""
    try:
        async with asyncio.TaskGroup() as group:
            tasks = [(part, group.create_task(process.done(limit_s))) for part, process in playing]
    except BaseExceptionGroup as failures:
        reasons, others = failures.split(TrialError)
        if reasons is None or others is not None:
            raise
        raise reasons.exceptions[0] from None
    return [Played(role=part.role, parameters=part.parameters, figures=task.result()) for part, task in tasks]


async def _hold(processes: TrialProcesses, case: Case, seconds: float) -> Outcome:
    """Make idle connections and measure the server for `WINDOW_S` while they are held."""
    (part,) = case.parts
    server = processes.server
    if server is None:
        raise TrialError("there is no server whose connections could be counted")
    connections = min(case.connections, raise_file_limit(ENOUGH_FILES) - SPARE_FILES)
    parameters = {**part.parameters, "connections": connections}
    empty_kib, few = meters.memory_kib(server.pid), meters.open_files(server.pid)
    process = await processes.add(part.role, {**parameters, "seconds": seconds})
    await process.go()
    await asyncio.sleep(PAUSE_S)
    before_s = meters.cpu_s(server.pid)
    await asyncio.sleep(WINDOW_S)
    after_s, full_kib = meters.cpu_s(server.pid), meters.memory_kib(server.pid)
    many = meters.open_files(server.pid)
    await process.release()
    figures = await process.done(DONE_TIMEOUT_S)
    return Outcome(
        played=(Played(role=part.role, parameters=parameters, figures=figures),),
        server_cpu_s=None if before_s is None or after_s is None else after_s - before_s,
        server_kib=None if empty_kib is None or full_kib is None else full_kib - empty_kib,
        server_files=None if few is None or many is None else many - few,
        window_s=WINDOW_S,
    )


def _server_cpu_s(processes: TrialProcesses) -> float | None:
    return None if processes.server is None else meters.cpu_s(processes.server.pid)
