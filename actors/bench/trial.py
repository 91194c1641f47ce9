"""One trial: one contender does one case once, in fresh processes, and its figures come out."""

from __future__ import annotations

import asyncio
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Final

from actors.bench import meters
from actors.bench.errors import TrialError
from actors.bench.outcomes import Outcome, Played
from actors.bench.processes import Stage
from proto.aio.process import raise_file_limit

if TYPE_CHECKING:
    from actors.bench.contender import Contender
    from actors.bench.processes import RoleProcess
    from actors.bench.workloads import Case, Part

DONE_TIMEOUT_S: Final = 60.0
"""Beyond the load: what consumers and their server may take to finish."""
SETTLE_S: Final = 3.0
"""After the last idle connection was made, before the server is watched."""
WINDOW_S: Final = 5.0
"""How long it is watched."""
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
        async with Stage(contender, Path(folder)) as stage:
            play = _hold if case.connections else _load
            return case.measure(await play(stage, case, seconds))


def missing(contender: Contender, case: Case) -> list[str]:
    """Return what a case needs and a contender does not have: roles, or what they must understand."""
    return sorted(({part.role for part in case.parts} | case.needs) - contender.roles)


async def _load(stage: Stage, case: Case, seconds: float) -> Outcome:
    """Let the roles go; the server's CPU time is measured until the last of them has ended."""
    playing: list[tuple[Part, RoleProcess]] = []
    for part in case.parts:
        process = await stage.add(part.role, {**part.parameters, "seconds": seconds})
        playing.append((part, process))
    before_s = _server_cpu_s(stage)
    for _, process in playing:
        await process.go()
    limit_s = seconds + DONE_TIMEOUT_S
    played = await _ends([each for each in playing if not each[0].held], limit_s)
    after_s = _server_cpu_s(stage)
    for part, process in reversed(playing):  # who was there first may serve those who came later
        if part.held:
            await process.release()
            played += await _ends([(part, process)], limit_s)
    used_s = None if before_s is None or after_s is None else after_s - before_s
    return Outcome(played=tuple(played), server_cpu_s=used_s)


async def _ends(playing: list[tuple[Part, RoleProcess]], limit_s: float) -> list[Played]:
    """Wait for the figures of all of them; the first failure is everybody's."""
    try:
        async with asyncio.TaskGroup() as group:
            tasks = [(part, group.create_task(process.done(limit_s))) for part, process in playing]
    except BaseExceptionGroup as failures:
        reasons, others = failures.split(TrialError)
        if reasons is None or others is not None:
            raise
        raise reasons.exceptions[0] from None
    return [Played(role=part.role, parameters=part.parameters, figures=task.result()) for part, task in tasks]


async def _hold(stage: Stage, case: Case, seconds: float) -> Outcome:
    """Make idle connections and watch the server while they are held, which no load's length changes."""
    (part,) = case.parts
    server = stage.server
    if server is None:
        raise TrialError("there is no server whose connections could be counted")
    connections = min(case.connections, raise_file_limit(ENOUGH_FILES) - SPARE_FILES)
    parameters = {**part.parameters, "connections": connections}
    empty_kib, few = meters.memory_kib(server.pid), meters.open_files(server.pid)
    process = await stage.add(part.role, {**parameters, "seconds": seconds})
    await process.go()
    await asyncio.sleep(SETTLE_S)
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


def _server_cpu_s(stage: Stage) -> float | None:
    return None if stage.server is None else meters.cpu_s(stage.server.pid)
