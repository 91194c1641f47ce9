"""Short runs of `callboard bench` have all figures and leave no process behind; speed is not checked."""

from __future__ import annotations

import asyncio
import json
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.integration.conftest import DEADLINE_SEC

if TYPE_CHECKING:
    from tests.integration.conftest import System

SHORT = ("--seconds", "0.1", "--repetitions", "1", "--json")


async def test_streams_and_calls_are_measured(system: System) -> None:
    """Every case of W1 and W3 has figures, nothing fails, and no process is left."""
    program = await system.python("-m", "actors", "bench", "W1", "W3", *SHORT)
    # Seven trials, and each starts three programs.
    assert await program.wait_for_exit(2.5 * DEADLINE_SEC) == 0, program.output
    document = json.loads(program.output)
    assert document["failures"] == []
    measured = {f"{each['workload']} {each['case']}": each["figures"] for each in document["samples"]}
    sizes = ("16 B", "256 B", "4 KiB", "64 KiB", "1 MiB", "8 MiB")
    assert list(measured) == [*(f"W1 {size}" for size in sizes), "W3 1 in flight"]
    for size in sizes:
        assert {"rate", "mb_s", "cpu_us.publisher", "cpu_us.subscriber"} <= measured[f"W1 {size}"].keys()
    calls = measured["W3 1 in flight"]
    assert 0 < calls["p50_us"] <= calls["p99_us"] <= calls["p999_us"]
    assert left_behind(system) == []


@pytest.mark.parametrize("options", [("--transport", "tcp"), ("--transport", "tls"), ("--loop", "asyncio")])
async def test_other_loops_and_transports_are_measured_alike(
    system: System, options: tuple[str, ...]
) -> None:
    """They have the same workload, and the results name them."""
    program = await system.python("-m", "actors", "bench", "W4", *SHORT, *options)
    assert await program.wait_for_exit() == 0, program.output
    (sample,) = json.loads(program.output)["samples"]
    assert sample["contender"] == f"callboard ({options[1]})"


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
async def test_a_signal_ends_everything(system: System, number: signal.Signals) -> None:
    """During a trial: the exit code names the signal; there is no traceback, and no process is left."""
    program = await system.python("-c", INTERRUPTED, forked=False)  # it is known by its command line
    await program.wait_for_line("at work")
    async with asyncio.timeout(DEADLINE_SEC):
        # The command, its guard, a broker and two roles: none of them while it becomes its program.
        while len(left_behind(system)) != 5:
            await asyncio.sleep(0.05)
    program.send_signal(number)
    assert await program.wait_for_exit() == 128 + number
    assert "Traceback" not in program.output
    assert left_behind(system) == []


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel of Linux ends the children")
async def test_a_killed_bench_leaves_no_process_behind(system: System) -> None:
    """After SIGKILL the kernel ends its processes."""
    program = await system.python("-c", INTERRUPTED)
    await program.wait_for_line("at work")
    program.send_signal(signal.SIGKILL)
    assert await program.wait_for_exit() == -signal.SIGKILL
    async with asyncio.timeout(DEADLINE_SEC):
        while left_behind(system):
            await asyncio.sleep(0.05)


INTERRUPTED = """
import sys
from actors.cli.main import main
from actors.processes.guard import Guard

start = Guard.start

def start_and_tell(self, command, **options):
    process = start(self, command, **options)
    if "publisher" in command[-1]:
        print("at work", flush=True)
    return process

Guard.start = start_and_tell
sys.argv[1:] = ["bench", "W1", "--seconds", "30"]
sys.exit(main())
"""
"""callboard bench; it reports when broker, subscriber and publisher have been started."""


def left_behind(system: System) -> list[str]:
    """Return the command lines of all processes with a test's environment, which children inherit."""
    mark = f"CALLBOARD_URL={system.url}".encode()
    found: list[str] = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if mark in (process / "environ").read_bytes().split(b"\0"):
                found.append((process / "cmdline").read_text("utf-8", "replace"))
        except OSError:  # it has ended meanwhile, or is not ours to read
            continue
    return found
