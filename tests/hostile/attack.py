"""Measure bystanders next to attacks of full size: `python -m tests.hostile.attack [NAME ...]`.

For each attack: two victims (`victims.py`), and a bystander (`innocents.py`, `visitors.py`) at one of them.
The attacker attacks the other one first, which shows what the machine's load alone costs (the reference), and
then that of the bystander. Required:

- p99 of what the bystander does at most 3 times that before the attack and 10 ms. (Cases up to 61: below
  25 ms, or below 5 times the reference);
- no message lost, no call or request failed;
- the victim's memory at most the attack's `memory_mib` above what it was, and less than 64 MiB above it after
  10 s.

With `--peers` other brokers get the attacks that fit them, too; nothing is required of them.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from tests.hostile.attacking import find_attacks
from tests.hostile.victims import Attack, Processes, Started, Victim, wait_until

if TYPE_CHECKING:
    from collections.abc import Callable

FIRST_RELATIVE_CASE: Final = 62
RELATIVE: Final = (3.0, 10.0)
"""From that case on: times the p99 before, and ms."""
P99_MS: Final = 25.0
P99_RATIO: Final = 5.0
BACK_MIB: Final = 64
BACK_SEC: Final = 10.0
SAMPLE_SEC: Final = 0.02
WARM_SEC: Final = 3.0


class Result(NamedTuple):
    """What an attack did; latencies are the largest p99 of what the bystander does."""

    attack: str
    victim: str
    case: int
    most_mib: int
    before_ms: float
    reference_ms: float
    during_ms: float
    after_ms: float
    lost: int
    failed: int
    memory_mib: float
    peak_mib: float
    after_mib: float

    @property
    def faults(self) -> list[str]:
        """Requirements that are not met."""
        most = max(P99_MS, P99_RATIO * self.reference_ms)
        if self.case >= FIRST_RELATIVE_CASE:
            times, added_ms = RELATIVE
            most = times * self.before_ms + added_ms
        return [
            text
            for text, wrong in (
                (f"p99 above {most:.0f} ms", not self.during_ms <= most),
                ("lost messages", self.lost),
                ("failures", self.failed),
                (f"more than {self.most_mib} MiB", self.peak_mib > self.memory_mib + self.most_mib),
                ("memory not returned", self.after_mib > self.memory_mib + BACK_MIB),
            )
            if wrong
        ]

    def line(self) -> str:
        """Return a line of the table."""
        latencies = (self.before_ms, self.reference_ms, self.during_ms, self.after_ms)
        memory = (self.memory_mib, self.peak_mib, self.after_mib)
        return (
            f"{self.case:4}  {self.attack:20}{self.victim:10}"
            + "".join(f"{each:10.1f}" for each in latencies)
            + f"{self.lost:6}{self.failed:8}"
            + "".join(f"{each:8.0f}" for each in memory)
            + "  "
            + (", ".join(self.faults) or "ok")
        )


HEADER: Final = (
    f"{'case':4}  {'attack':20}{'victim':10}{'p99 ms':>10}{'reference':>10}{'during':>10}{'after':>10}"
    f"{'lost':>6}{'failed':>8}{'MiB':>8}{'peak':>8}{'after':>8}"
)


def memory_mib(pid: int) -> float:
    """Return the resident memory of a process."""
    for line in Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    raise ProcessLookupError(pid)


def measure(name: str, attack: Attack, victim: Victim, seconds: float) -> Result:
    """Run one attack on one kind of victim."""
    with ExitStack() as stack:
        processes = Processes(stack)
        attacked, other = victim.start(processes, "attacked"), victim.start(processes, "other")
        output = stack.enter_context(tempfile.TemporaryFile())
        bystander = processes.start(
            victim.bystander, *attacked.bystander, stdin=subprocess.PIPE, stdout=output, env=attacked.env
        )
        wait_until("the bystander", lambda: os.fstat(output.fileno()).st_size)
        time.sleep(WARM_SEC)
        calm = time.monotonic()
        time.sleep(seconds)
        before = memory_mib(attacked.pid)

        def run(target: Started, sample: Callable[[], None]) -> tuple[float, float]:
            attacker = processes.start(
                "tests.hostile.attacking", name, *target.target, stdout=subprocess.PIPE
            )
            attacker.stdout.readline()
            began = time.monotonic()
            while time.monotonic() < began + seconds:
                sample()
                time.sleep(SAMPLE_SEC)
            attacker.kill()
            return began, time.monotonic()

        reference = run(other, lambda: None)
        time.sleep(1.0)
        memory = [before]
        during = run(attacked, lambda: memory.append(memory_mib(attacked.pid)))
        back, after = time.monotonic() + BACK_SEC, memory[-1]
        while time.monotonic() < back and after > before + BACK_MIB / 2:
            time.sleep(0.1)
            memory.append(after := memory_mib(attacked.pid))
        ended = time.monotonic()
        time.sleep(seconds)
        bystander.stdin.close()
        bystander.wait(timeout=30)
        output.seek(0)
        found: dict[str, Any] = json.loads(output.read().partition(b"\n")[2])
    samples = found["samples"]
    return Result(
        attack=name,
        victim=victim.name,
        case=attack.case,
        most_mib=attack.memory_mib,
        before_ms=p99_ms(samples, calm, calm + seconds),
        reference_ms=p99_ms(samples, *reference),
        during_ms=p99_ms(samples, *during),
        after_ms=p99_ms(samples, ended, ended + seconds),
        lost=found["lost"],
        failed=found["failed"],
        memory_mib=before,
        peak_mib=max(memory),
        after_mib=after,
    )


def p99_ms(samples: dict[str, list[tuple[float, float]]], start: float, end: float) -> float:
    """Return the largest p99 of any kind of sample that began in a time, in ms; infinite without any."""
    largest = 0.0
    for kind in samples.values():
        latencies = sorted(latency for began, latency in kind if start <= began < end)
        largest = max(largest, latencies[len(latencies) * 99 // 100] * 1000 if latencies else float("inf"))
    return largest


def main() -> int:
    """Run attacks and print the table; return 1 if callboard does not meet a requirement."""
    attacks = find_attacks()
    parser = argparse.ArgumentParser(prog="python -m tests.hostile.attack")
    parser.add_argument("attacks", nargs="*", metavar="NAME", help="see --list; all by default")
    parser.add_argument("--list", action="store_true", help="list the attacks and what they attack")
    parser.add_argument("--seconds", type=float, default=5.0, help="duration of each part")
    parser.add_argument("--peers", action="store_true", help="attack other brokers, too, where it fits")
    parser.add_argument("--json", type=Path, help="write the results there, too")
    chosen = parser.parse_args()
    if unknown := set(chosen.attacks) - set(attacks):
        parser.error(f"unknown: {', '.join(sorted(unknown))}")
    selected = {name: attacks[name] for name in chosen.attacks or attacks}
    if chosen.list:
        for name, attack in selected.items():
            peers = "".join(f", {each.name}" for each in attack.peers)
            print_line(f"{attack.case:4}  {name:20}{attack.victim.name}{peers}")
        return 0
    results: list[Result] = []
    failed = False
    print_line(HEADER)
    for name, attack in selected.items():
        for victim in (attack.victim, *(attack.peers if chosen.peers else ())):
            results.append(measure(name, attack, victim, chosen.seconds))
            failed |= victim is attack.victim and bool(results[-1].faults)
            print_line(results[-1].line())
    if chosen.json is not None:
        chosen.json.parent.mkdir(parents=True, exist_ok=True)
        content = [result._asdict() | {"faults": result.faults} for result in results]
        chosen.json.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    return int(failed)


def print_line(text: str) -> None:
    """Print at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
