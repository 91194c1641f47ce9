"""Runs scenarios, each with a broker of its own, and compares the output of their programs with the table."""

from __future__ import annotations

import asyncio
import os
import re
import shlex
import signal
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tests.integration.conftest import System
from tests.upstream.runs import CALLBOARD, OURS, Run

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from tests.integration.conftest import Program
    from tests.upstream.packages import Packages

SHOW_TIMEOUT_SEC: Final = 60.0
"""For all patterns of a run: some programs take a second for each of their steps."""
COMMAND_TIMEOUT_SEC: Final = 30.0
"""For a command until it succeeds."""
MAX_OUTPUT_CHARS: Final = 4000
POLL_SEC: Final = 0.05
KINDS: Final = ("same", "differs", "cannot")
_ABSENT: Final = re.compile(r"^(?:ModuleNotFoundError|ImportError|NotImplementedError): .*$", re.MULTILINE)
_RAISED: Final = re.compile(r"^(?:\w+\.)*\w*(?:Error|Exception|Interrupt)\b.*$", re.MULTILINE)


@dataclass(frozen=True)
class Verdict:
    """How a program has behaved.

    Attributes:
        package: Its package.
        executable: Its console script, with the verb of a command.
        kind: "same" as upstream, "differs", or "cannot" run as something is absent.
        reason: Why it is not the same.
        output: The end of what it has printed; "" if it is the same.
    """

    package: str
    executable: str
    kind: str
    reason: str = ""
    output: str = ""

    def __str__(self) -> str:
        return f"{self.kind:8} {self.package} {self.executable}" + (f": {self.reason}" if self.reason else "")


def worst(verdicts: Iterable[Verdict]) -> list[Verdict]:
    """Return one verdict for each program: that of its worst run."""
    found: dict[tuple[str, str], Verdict] = {}
    for each in verdicts:
        key = each.package, each.executable
        if key not in found or KINDS.index(each.kind) > KINDS.index(found[key].kind):
            found[key] = each
    return [found[key] for key in sorted(found)]


class Runner:
    """Runs scenarios.

    Args:
        packages: The installed packages.
        jobs: How many scenarios run at the same time.
    """

    def __init__(self, packages: Packages, jobs: int) -> None:
        self._site = packages.site
        self._jobs = asyncio.Semaphore(jobs)

    async def run_all(self, scenarios: Iterable[Sequence[Run]]) -> list[Verdict]:
        """Return the verdicts of all runs of upstream's programs."""
        async with asyncio.TaskGroup() as group:
            tasks = [group.create_task(self._run(each)) for each in scenarios]
        return [verdict for task in tasks for verdict in task.result()]

    async def _run(self, scenario: Sequence[Run]) -> list[Verdict]:
        async with self._jobs:
            system = System()
            try:
                await system.broker()
                return await self._compare(scenario, system)
            finally:
                await system.close()

    async def _compare(self, scenario: Sequence[Run], system: System) -> list[Verdict]:
        """Start the programs, wait until each has shown its patterns, and then for their ends."""
        programs: list[Program] = []
        for run in scenario:
            if run.after:
                await _wait_for_patterns(programs[0], (run.after,))
            programs.append(await self._start(run, system))
        pairs = list(zip(scenario, programs, strict=True))
        shown = [await _wait_for_patterns(program, run.shows) for run, program in pairs]
        ends = await asyncio.gather(*(_end(run, program) for run, program in pairs))
        faults = [first or second for first, second in zip(shown, ends, strict=True)]
        # A fault of our own commands and programs counts against the first program of upstream.
        ours = [
            f"{run.name}: {fault}"
            for run, fault in zip(scenario, faults, strict=True)
            if fault and not run.is_upstream
        ]
        first = next(number for number, run in enumerate(scenario) if run.is_upstream)
        faults[first] = faults[first] or next(iter(ours), "")
        return [
            _verdict(run, program.output, fault)
            for (run, program), fault in zip(pairs, faults, strict=True)
            if run.is_upstream
        ]

    async def _start(self, run: Run, system: System) -> Program:
        """Start a program, or run a command."""
        if run.package == CALLBOARD:
            return await _succeeding(run, system)
        program: tuple[str, ...] = (run.package, run.executable)
        if run.package == OURS:
            program = (str(Path(__file__).with_name(f"{run.executable}.py")),)
        environ = {**os.environ, "PYTHONPATH": str(self._site), "AMENT_PREFIX_PATH": str(self._site)}
        command = (sys.executable, "-m", "actors.ros", "--no-broker", *program, *run.args)
        return await system.program(*command, environ=environ)


async def _succeeding(run: Run, system: System) -> Program:
    """Run a command again until it succeeds or the time is over: what it asks for may not be there yet."""
    deadline = asyncio.get_running_loop().time() + COMMAND_TIMEOUT_SEC
    while True:
        program = await system.python("-m", "actors", *shlex.split(run.executable))
        try:
            code = await program.wait_for_exit()
        except AssertionError:  # it still waits
            await program.kill()
            return program
        if not code or asyncio.get_running_loop().time() > deadline:
            return program


async def _wait_for_patterns(program: Program, patterns: Sequence[str]) -> str:
    """Wait until all patterns match, in their order; return "", or which one does not match in time."""
    deadline = asyncio.get_running_loop().time() + SHOW_TIMEOUT_SEC
    position = 0
    for pattern in patterns:
        while (found := re.compile(pattern).search(program.output, position)) is None:
            if program.ended or asyncio.get_running_loop().time() > deadline:
                return f"does not show {pattern!r}"
            await asyncio.sleep(POLL_SEC)
        position = found.end()
    return ""


async def _end(run: Run, program: Program) -> str:
    """Wait for the end of a program, or end it with SIGINT; return "", or what is wrong with its end."""
    if not run.ends and not program.ended:
        program.send_signal(signal.SIGINT)
    try:
        code = await program.wait_for_exit()
    except AssertionError:
        await program.kill()
        return "does not end" if run.ends else "does not end after SIGINT"
    if code not in run.codes:
        return f"ends with {code}"
    if run.quiet and "Traceback" in program.output:
        return "shows a traceback"
    return ""


def _verdict(run: Run, output: str, reason: str) -> Verdict:
    """Return the verdict on a run, with its last error."""
    if not reason:
        return Verdict(run.package, run.program, "same")
    absent, raised = _ABSENT.findall(output), _RAISED.findall(output)
    kind = "cannot" if absent else "differs"
    reason = absent[-1] if absent else "; ".join([reason, *raised[-1:]])
    return Verdict(run.package, run.program, kind, reason, output[-MAX_OUTPUT_CHARS:])
