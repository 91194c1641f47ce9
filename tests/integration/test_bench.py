"""`callboard bench` for real, but short: it counts right and leaves nothing behind. How fast is not asked."""

from __future__ import annotations

import asyncio
import json
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from tests.integration.conftest import System

SHORT = ("--seconds", "0.3", "--repetitions", "1", "--json")


async def test_figures_of_streams_and_calls_come_out(system: System) -> None:
    """Every case of W1 and W3 has its figures, nothing failed, nobody is left."""
    program = await system.python("-m", "actors", "bench", "W1", "W3", *SHORT)
    assert await program.ends() == 0, program.output
    document = json.loads(program.output)
    assert document["failures"] == []
    measured = {f"{each['workload']} {each['case']}": each["figures"] for each in document["samples"]}
    sizes = ("16 B", "256 B", "4 KiB", "64 KiB", "1 MiB")
    assert list(measured) == [*(f"W1 {size}" for size in sizes), "W3 1 in flight"]
    for size in sizes:
        assert {"rate", "mb_s", "cpu_us.publisher", "cpu_us.subscriber"} <= measured[f"W1 {size}"].keys()
    calls = measured["W3 1 in flight"]
    assert 0 < calls["p50_us"] <= calls["p99_us"] <= calls["p999_us"]
    assert left_behind(system) == []


@pytest.mark.parametrize("options", [("--transport", "unix"), ("--loop", "asyncio")])
async def test_other_loops_and_transports_are_measured_alike(
    system: System, options: tuple[str, ...]
) -> None:
    """And are named in the results."""
    program = await system.python("-m", "actors", "bench", "W4", *SHORT, *options)
    assert await program.ends() == 0, program.output
    (sample,) = json.loads(program.output)["samples"]
    assert sample["contender"] == f"callboard ({options[1]})"


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
async def test_a_signal_ends_everything(system: System, number: signal.Signals) -> None:
    """In mid-trial: the exit code says which, no traceback, no process."""
    program = await system.python("-c", INTERRUPTED)
    await program.says("at work")
    assert len(left_behind(system)) == 4
    program.send(number)
    assert await program.ends() == 128 + number
    assert "Traceback" not in program.output
    assert left_behind(system) == []


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel of Linux ends the children")
async def test_a_bench_that_is_killed_takes_its_processes_along(system: System) -> None:
    """SIGKILL leaves it no time to: servers go with it all the same."""
    program = await system.python("-c", INTERRUPTED)
    await program.says("at work")
    program.send(signal.SIGKILL)
    assert await program.ends() == -signal.SIGKILL
    async with asyncio.timeout(20):
        while left_behind(system):
            await asyncio.sleep(0.05)


INTERRUPTED = """
import sys
from actors.bench.processes import RoleProcess
from actors.cli.main import main

done = RoleProcess.done

async def tell_first(self, timeout_s):
    if self.name.startswith("publisher"):
        print("at work", flush=True)
    return await done(self, timeout_s)

RoleProcess.done = tell_first
sys.argv[1:] = ["bench", "W1", "--seconds", "30"]
sys.exit(main())
"""
"""callboard bench, but it says when broker, subscriber and publisher are at work."""


def left_behind(system: System) -> list[str]:
    """Return the processes that run in a test's environment: its programs' children inherit it."""
    mark = f"CALLBOARD_URL={system.url}".encode()
    found: list[str] = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if mark in (process / "environ").read_bytes().split(b"\0"):
                found.append((process / "cmdline").read_text("utf-8", "replace"))
        except OSError:  # it has ended meanwhile, or is not ours to read
            continue
    return found
