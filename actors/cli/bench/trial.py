"""One trial: a broker and two roles, each in new processes, and their figures."""

from __future__ import annotations

import asyncio
import json
import os
from contextlib import AsyncExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.cli.errors import CommandError
from actors.config.environment import environment_for
from actors.processes.guard import Guard

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import BinaryIO

    from actors.cli.bench.setup import Setup

START_SEC: Final = 20.0
"""How long the broker may take to listen."""
TRIAL_SEC: Final = 100.0
"""How long the roles may take beside their load. They wait less for each other, so that they fail first."""
IN_FLIGHT: Final = 100
SIZES: Final = {
    "16 B": 16,
    "256 B": 256,
    "4 KiB": 4096,
    "64 KiB": 65_536,
    "1 MiB": 1_048_576,
    "8 MiB": 8_388_608,
}
_LOG_LINES: Final = 5
"""Lines at the end of a process's log that an error shows."""
CPU: Final = "cpu_us."
"""Before a role's name: the key of its CPU time per message, in us."""


class Case(NamedTuple):
    """One configuration of a workload.

    Attributes:
        name: Such as "256 B".
        roles: The one that waits for messages or calls, and the one that sends them.
        parameters: Those of both.
    """

    name: str
    roles: tuple[str, str]
    parameters: Mapping[str, int]


class Workload(NamedTuple):
    """Cases with figures that can be compared.

    Attributes:
        title: What is measured.
        figures: The keys of figures, and their titles.
        cases: The first `quick` ones are measured if no workload is named.
    """

    title: str
    figures: Mapping[str, str]
    cases: Sequence[Case]
    quick: int


WORKLOADS: Final = {
    "W1": Workload(
        "one publisher, one subscriber, KEEP_ALL, nothing lost",
        {"rate": "msg/s", "mb_s": "MB/s"},
        [Case(name, ("subscriber", "publisher"), {"size": size}) for name, size in SIZES.items()],
        quick=5,
    ),
    "W3": Workload(
        "add_two_ints, one call at a time",
        {"p50_us": "p50 us", "p99_us": "p99 us", "p999_us": "p99.9 us"},
        [Case("1 in flight", ("server", "requester"), {"in_flight": 1})],
        quick=1,
    ),
    "W4": Workload(
        "add_two_ints, 100 calls in flight",
        {"rate": "req/s"},
        [Case("100 in flight", ("server", "requester"), {"in_flight": IN_FLIGHT})],
        quick=1,
    ),
}


async def run_trial(setup: Setup, case: Case, seconds: float) -> dict[str, float]:
    """Run one trial; no process of it is left.

    Args:
        setup: How to run it.
        case: What to run.
        seconds: The length of its load.

    Returns:
        The figures of the case, and `cpu_us.` of each role and the broker per message or call.

    Raises:
        CommandError: A process failed or took too long, or messages were lost.
    """
    with TemporaryDirectory(prefix="callboard-bench-") as name:
        folder = Path(name)
        async with AsyncExitStack() as stack:
            guard = Guard()
            stack.push_async_callback(guard.close)

            async def start(name: str, command: list[str]) -> _Program:
                program = _Program(name, guard, command, folder, setup.variables(folder))
                stack.callback(program.kill)
                return program

            broker = await start("broker", setup.command("broker", *setup.broker_options(0, folder)))
            url = (await broker.line(START_SEC)).split()[-1]
            parameters = {"url": url, "seconds": seconds, "broker_pid": broker.pid, **case.parameters}
            roles = [
                await start(
                    role,
                    setup.command("actors.cli.bench.roles", json.dumps({"role": role, **parameters})),
                )
                for role in case.roles
            ]
            try:
                async with asyncio.TaskGroup() as group:
                    reports = [group.create_task(role.line(seconds + TRIAL_SEC)) for role in roles]
            except ExceptionGroup as errors:  # of failures at the same time the first is enough
                raise errors.exceptions[0] from None
    receiver, sender = (json.loads(report.result()) for report in reports)
    return _figures(case, receiver, sender)


def _figures(case: Case, receiver: dict[str, Any], sender: dict[str, Any]) -> dict[str, float]:
    """Return the figures of a trial from the reports of its roles."""
    found: dict[str, float] = {
        key: sender[key] for key in ("rate", "p50_us", "p99_us", "p999_us") if key in sender
    }
    if "elapsed_sec" in receiver:  # a stream
        received, sent = receiver["messages"], sender["messages"]
        if received != sent or receiver["lost"] or sender["lost"]:
            raise CommandError(f"lost messages: {received} of {sent} received")
        found["rate"] = received / receiver["elapsed_sec"]
        found["mb_s"] = found["rate"] * case.parameters["size"] / 1e6
    used = {case.roles[1]: (sender["cpu_sec"], sender), "broker": (sender["broker_cpu_sec"], sender)}
    used[case.roles[0]] = (receiver["cpu_sec"], receiver)
    for role, (cpu_sec, report) in used.items():
        if cpu_sec is not None:
            found[CPU + role] = 1e6 * cpu_sec / report["messages"]
    return found


class _Program:
    """A process of a trial: it writes lines to a pipe, and its errors to a file."""

    def __init__(
        self, name: str, guard: Guard, command: list[str], folder: Path, variables: Mapping[str, str]
    ) -> None:
        self._name = name
        self._guard = guard
        self._log = folder / f"{name}.log"
        reading, writing = os.pipe()
        # Owned here until `line` gives it to a transport: a trial may end before it reads any line.
        self._output: BinaryIO | None = os.fdopen(reading, "rb", 0)
        try:
            with self._log.open("wb") as log:
                self._process = guard.start(
                    command, cwd=None, env=environment_for(variables), output=writing, errors=log.fileno()
                )
        except OSError:
            self._output.close()
            raise
        finally:
            os.close(writing)
        self.pid = self._process.pid

    async def line(self, timeout_sec: float) -> str:
        """Return the line that it writes; to be called once.

        Raises:
            CommandError: It wrote none in time, or ended without one.
        """
        output, self._output = self._output, None
        reader = asyncio.StreamReader()
        loop = asyncio.get_running_loop()
        transport, _ = await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), output)
        try:
            async with asyncio.timeout(timeout_sec):
                line = await reader.readline()
                if not line:
                    raise self._failure(f"ended with {await self._process.wait()}")
        except TimeoutError:
            raise self._failure(f"has written nothing within {timeout_sec:g} s") from None
        finally:
            transport.close()
        return line.decode()

    def kill(self) -> None:
        """Kill its group and wait for its end."""
        if self._output is not None:
            self._output.close()
        self._process.reap()
        self._guard.forget(self.pid)

    def _failure(self, what: str) -> CommandError:
        lines = self._log.read_text("utf-8", "replace").splitlines()[-_LOG_LINES:]
        return CommandError("\n".join([f"{self._name} {what}", *(f"    {line}" for line in lines)]))
