"""Trials: their figures, and what fails them."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from actors.cli.bench.setup import Setup
from actors.cli.bench.trial import Case, run_trial
from actors.cli.errors import CommandError

BROKER = "import time; print('listening on callboard://there:1', flush=True); time.sleep(1000)"
REPORT = "import json, sys; print(json.dumps({}[json.loads(sys.argv[-1])['role']]))"
SENT: dict[str, Any] = {"cpu_sec": 2.0, "broker_cpu_sec": 1.0, "messages": 1000, "lost": 0}
RECEIVED: dict[str, Any] = {
    "cpu_sec": 4.0,
    "broker_cpu_sec": None,
    "messages": 1000,
    "lost": 0,
    "elapsed_sec": 0.5,
}
STREAM = Case("256 B", ("subscriber", "publisher"), {"size": 256})


@dataclass(frozen=True, kw_only=True)
class Programs(Setup):
    """Programs in place of the broker and the roles."""

    role: str

    def command(self, module: str, *arguments: str) -> list[str]:
        code = BROKER if module == "broker" else self.role
        return [sys.executable, "-c", code, *arguments]


def _reports(**changes: Any) -> Programs:
    return Programs(role=REPORT.format({"subscriber": RECEIVED | changes, "publisher": SENT}))


@pytest.mark.processes
async def test_figures_are_computed_from_reports() -> None:
    """The rate is the receiver's; CPU time is per message, of each process."""
    assert await run_trial(_reports(), STREAM, 1.0) == {
        "rate": 2000.0,
        "mb_s": 0.512,
        "cpu_us.publisher": 2000.0,
        "cpu_us.broker": 1000.0,
        "cpu_us.subscriber": 4000.0,
    }


@pytest.mark.parametrize("changes", [{"messages": 999}, {"lost": 1}])
@pytest.mark.processes
async def test_lost_messages_fail_a_trial(changes: dict[str, int]) -> None:
    """Its rate would mean nothing."""
    with pytest.raises(CommandError, match="lost messages"):
        await run_trial(_reports(**changes), STREAM, 1.0)


@pytest.mark.processes
async def test_a_role_that_fails_ends_the_trial() -> None:
    """At once, with the end of its log, while the other role still runs."""
    code = "import sys, time; 'publisher' in sys.argv[-1] and sys.exit('no broker there'); time.sleep(1000)"
    with pytest.raises(CommandError, match=r"publisher ended with 1\n    no broker there"):
        await run_trial(Programs(role=code), STREAM, 1.0)


def test_tls_needs_its_package(monkeypatch: pytest.MonkeyPatch) -> None:
    """The error names the extra."""
    monkeypatch.setattr("actors.cli.bench.setup.find_spec", lambda name: None)
    with pytest.raises(CommandError, match="bench"):
        Setup(transport="tls")


def test_a_module_runs_without_uvloop() -> None:
    """The module is the program, with its own arguments, and uvloop cannot be imported."""
    statement = "import sys; assert sys.modules['uvloop'] is None"
    command = Setup(loop="asyncio").command("timeit", "-n", "1", "-r", "1", statement)
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=30)
    assert done.returncode == 0, done.stderr
    assert "1 loop" in done.stdout


class WithoutPublisher(Programs):
    """The publisher's program cannot be started."""

    def command(self, module: str, *arguments: str) -> list[str]:
        if module != "broker" and json.loads(arguments[-1])["role"] == "publisher":
            raise FileNotFoundError("no program")
        return super().command(module, *arguments)


def _descriptors() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


@pytest.mark.skipif(sys.platform != "linux", reason="/proc")
@pytest.mark.processes
async def test_a_role_that_does_not_start_leaves_no_descriptor() -> None:
    """Nobody reads from the subscriber then, whose pipe is closed all the same."""
    await run_trial(_reports(), STREAM, 1.0)  # what is opened once is open now
    before = _descriptors()
    with pytest.raises(FileNotFoundError):
        await run_trial(WithoutPublisher(role=REPORT.format({"subscriber": RECEIVED})), STREAM, 1.0)
    assert _descriptors() <= before  # what earlier tests have left may be closed meanwhile
