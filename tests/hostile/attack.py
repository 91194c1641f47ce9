"""Measure innocent nodes next to attacks of full size: `python -m tests.hostile.attack [NAME ...]`.

For each attack: a broker with the innocents (`innocents.py`), and a second broker. The attacker attacks the
second one first, which shows what the machine's load alone costs (the reference), and then theirs. Required:

- p99 of messages and calls below 25 ms, or below 5 times the reference;
- no message lost, no call failed;
- the broker's memory at most the attack's `memory_mib` above what it was, and less than 64 MiB above it after
  10 s.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final, NamedTuple

from tests.hostile.attacks import ATTACKS

if TYPE_CHECKING:
    from collections.abc import Callable

P99_MS: Final = 25.0
P99_RATIO: Final = 5.0
BACK_MIB: Final = 64
BACK_SEC: Final = 10.0
SAMPLE_SEC: Final = 0.02


class Result(NamedTuple):
    """What an attack did; latencies are the larger p99 of messages and calls."""

    attack: str
    case: int
    before_ms: float
    reference_ms: float
    during_ms: float
    lost: int
    failed: int
    memory_mib: float
    peak_mib: float
    after_mib: float

    @property
    def faults(self) -> list[str]:
        """Requirements that are not met."""
        most = max(P99_MS, P99_RATIO * self.reference_ms)
        added = ATTACKS[self.attack].memory_mib
        return [
            text
            for text, wrong in (
                (f"p99 above {most:.0f} ms", not self.during_ms <= most),
                ("lost messages", self.lost),
                ("failed calls", self.failed),
                (f"more than {added} MiB", self.peak_mib > self.memory_mib + added),
                ("memory not returned", self.after_mib > self.memory_mib + BACK_MIB),
            )
            if wrong
        ]

    def line(self) -> str:
        """Return a line of the table."""
        latencies = f"{self.before_ms:8.1f}{self.reference_ms:11.1f}{self.during_ms:8.1f}"
        return (
            f"{self.case:4}  {self.attack:14}{latencies}"
            f"{self.lost:6}{self.failed:8}{self.memory_mib:8.0f}{self.peak_mib:8.0f}{self.after_mib:8.0f}  "
            + (", ".join(self.faults) or "ok")
        )


HEADER: Final = (
    f"{'case':4}  {'attack':14}{'p99 ms':>8}{'reference':>11}{'during':>8}"
    f"{'lost':>6}{'failed':>8}{'MiB':>8}{'peak':>8}{'after':>8}"
)


class Processes:
    """The processes of one measurement."""

    def __init__(self, stack: ExitStack) -> None:
        self._stack = stack
        self._folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))

    def start(self, *command: str, stdin: int = subprocess.DEVNULL, stdout: int | IO[bytes]) -> Any:
        """Start a Python module; it is killed in the end."""
        process = subprocess.Popen([sys.executable, "-m", *command], stdin=stdin, stdout=stdout)
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return process

    def broker(self, name: str) -> tuple[int, str]:
        """Start a broker; return its process id and its URL."""
        file = self._folder / name
        command = ("broker", "--port", "0", "--url-file", str(file), "--log-level", "error")
        process = self.start(*command, stdout=subprocess.DEVNULL)
        deadline = time.monotonic() + 10
        while not (file.exists() and file.read_text().strip()):
            if time.monotonic() > deadline:
                raise TimeoutError("the broker does not start")
            time.sleep(SAMPLE_SEC)
        return process.pid, file.read_text().strip()


def memory_mib(pid: int) -> float:
    """Return the resident memory of a process."""
    for line in Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    raise ProcessLookupError(pid)


def measure(name: str, seconds: float) -> Result:
    """Run one attack."""
    with ExitStack() as stack:
        processes = Processes(stack)
        broker, url = processes.broker("url")
        _, other = processes.broker("other")
        output = stack.enter_context(tempfile.TemporaryFile())
        innocents = processes.start("tests.hostile.innocents", url, stdin=subprocess.PIPE, stdout=output)
        time.sleep(3.0)  # they start, and warm up
        calm = time.monotonic()
        time.sleep(seconds)
        before = memory_mib(broker)

        def attack(target: str, sample: Callable[[], None]) -> tuple[float, float]:
            attacker = processes.start("tests.hostile.attacks", name, target, stdout=subprocess.PIPE)
            attacker.stdout.readline()
            began = time.monotonic()
            while time.monotonic() < began + seconds:
                sample()
                time.sleep(SAMPLE_SEC)
            attacker.kill()
            return began, time.monotonic()

        reference = attack(other, lambda: None)
        time.sleep(1.0)
        memory = [before]
        during = attack(url, lambda: memory.append(memory_mib(broker)))
        back, after = time.monotonic() + BACK_SEC, memory[-1]
        while time.monotonic() < back and after > before + BACK_MIB / 2:
            time.sleep(0.1)
            memory.append(after := memory_mib(broker))
        innocents.stdin.close()
        innocents.wait(timeout=30)
        output.seek(0)
        found = json.loads(output.read().partition(b"\n")[2])
    samples = found["samples"]
    return Result(
        name,
        ATTACKS[name].case,
        p99_ms(samples, calm, calm + seconds),
        p99_ms(samples, *reference),
        p99_ms(samples, *during),
        found["lost"],
        found["failed"],
        before,
        max(memory),
        after,
    )


def p99_ms(samples: dict[str, list[tuple[float, float]]], start: float, end: float) -> float:
    """Return the larger p99 of messages and calls that began in a time, in ms; infinite without any."""
    largest = 0.0
    for kind in samples.values():
        latencies = sorted(latency for began, latency in kind if start <= began < end)
        largest = max(largest, latencies[len(latencies) * 99 // 100] * 1000 if latencies else float("inf"))
    return largest


def main() -> int:
    """Run attacks and print the table; return 1 if a requirement is not met."""
    parser = argparse.ArgumentParser(prog="python -m tests.hostile.attack")
    parser.add_argument("attacks", nargs="*", metavar="NAME", help=f"of {', '.join(ATTACKS)}; all by default")
    parser.add_argument("--seconds", type=float, default=5.0, help="duration of each part")
    parser.add_argument("--json", type=Path, help="write the results there, too")
    chosen = parser.parse_args()
    if unknown := set(chosen.attacks) - set(ATTACKS):
        parser.error(f"unknown: {', '.join(sorted(unknown))}")
    results: list[Result] = []
    print_line(HEADER)
    for name in chosen.attacks or ATTACKS:
        results.append(measure(name, chosen.seconds))
        print_line(results[-1].line())
    if chosen.json is not None:
        chosen.json.parent.mkdir(parents=True, exist_ok=True)
        content = [result._asdict() | {"faults": result.faults} for result in results]
        chosen.json.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    return int(any(result.faults for result in results))


def print_line(text: str) -> None:
    """Print at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
