"""A broker is killed under load and restarted: recovery times, losses, calls that hang, leaks.

The nodes form a ring over several processes (`roles/ring.py`): each publishes to the next, calls it ten
times a second, and always has one call in flight there that is never answered.
"""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from benchmarks.faults.figures import Section, milliseconds, peak
from benchmarks.faults.processes import ControlledProcess, ProcessGroup

if TYPE_CHECKING:
    from collections.abc import Sequence

STORM_WINDOW_S: Final = 0.1


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Size of the ring and number of restarts.

    Attributes:
        nodes: Number of nodes in the ring.
        processes: Number of processes that share the nodes evenly.
        rate: Messages a second per node.
        pauses_s: Seconds without a broker, one entry per restart.
        settle_s: Seconds of undisturbed traffic before each kill.
    """

    nodes: int = 200
    processes: int = 4
    rate: float = 50.0
    pauses_s: Sequence[float] = (0.0, 0.0, 0.0, 5.0, 5.0)
    settle_s: float = 3.0


@dataclass(kw_only=True)
class Restart:
    """One restart; times in seconds.

    Attributes:
        pause: How long no broker was running.
        failed: From the kill until each node's call in flight failed.
        received, answered: From the new broker's start until each node's first message and first reply.
        attempts: Times of all connection attempts since the kill.
    """

    pause: float
    failed: list[float] = field(default_factory=list[float])
    received: list[float] = field(default_factory=list[float])
    answered: list[float] = field(default_factory=list[float])
    attempts: list[float] = field(default_factory=list[float])


@dataclass(kw_only=True)
class Results:
    """Results of all restarts.

    Attributes:
        totals: Messages and calls of all nodes by outcome.
        before, after: Tasks, files and memory (KiB) of all processes together.
    """

    plan: Plan
    restarts: list[Restart] = field(default_factory=list[Restart])
    totals: Counter[str] = field(default_factory=Counter[str])
    before: Counter[str] = field(default_factory=Counter[str])
    after: Counter[str] = field(default_factory=Counter[str])


async def measure(plan: Plan) -> Results:
    """Set up the ring, kill its broker once per pause, and add up the results."""
    found = Results(plan=plan)
    async with ProcessGroup() as processes:
        broker = await processes.start_broker()
        parts = [
            await processes.start_role(
                "ring", numbers=list(range(i, plan.nodes, plan.processes)), total=plan.nodes, rate=plan.rate
            )
            for i in range(plan.processes)
        ]
        await _wait_for_all(parts, "ready")
        await _send_all(parts, "go")
        for event in await _wait_for_all(parts, "going"):
            found.before.update(_resources(event))
        for pause in plan.pauses_s:
            await asyncio.sleep(plan.settle_s)
            broker, restart, found.after = await _restart(processes, broker, parts, pause)
            found.restarts.append(restart)
        await asyncio.sleep(plan.settle_s)
        await _send_all(parts, "stop")
        for event in await _wait_for_all(parts, "totals"):
            for member in event["members"]:
                found.totals.update(member)
    return found


async def _restart(
    processes: ProcessGroup, broker: ControlledProcess, parts: list[ControlledProcess], pause: float
) -> tuple[ControlledProcess, Restart, Counter[str]]:
    restart, after = Restart(pause=pause), Counter[str]()
    await _send_all(parts, "brace")
    await _wait_for_all(parts, "braced")
    killed = time.monotonic()
    await processes.stop(broker)
    await asyncio.sleep(pause)
    broker = await processes.start_broker()
    listening = time.monotonic()
    for event in await _wait_for_all(parts, "back"):
        for failed_at, received_at, answered_at in event["members"]:
            restart.failed.append(failed_at - killed)
            restart.received.append(received_at - listening)
            restart.answered.append(answered_at - listening)
        restart.attempts += [at - killed for at in event["attempts"]]
        after.update(_resources(event))
    return broker, restart, after


async def _send_all(parts: list[ControlledProcess], word: str) -> None:
    for part in parts:
        await part.send_command(word)


async def _wait_for_all(parts: list[ControlledProcess], event: str) -> list[dict[str, Any]]:
    return [await part.wait_for_event(event) for part in parts]


def _resources(event: dict[str, Any]) -> dict[str, int]:
    return {key: round(event[key] or 0) for key in ("tasks", "files", "memory_kib")}


def section(found: Results) -> Section:
    """Return the table of restarts; violated promises are failures."""
    plan, rows, figures = found.plan, list[list[str]](), list[dict[str, Any]]()
    for restart in found.restarts:
        failed = milliseconds(restart.failed)
        back = [max(pair) for pair in zip(restart.received, restart.answered, strict=True)]
        storm = peak(restart.attempts, STORM_WINDOW_S)
        rows.append(
            [
                f"{restart.pause:g} s",
                f"{failed['p50_ms']:.0f} / {failed['max_ms']:.0f} ms",
                f"{milliseconds(back)['p50_ms'] / 1000:.2f} s",
                f"{max(back):.2f} s",
                f"{len(restart.attempts):,}",
                f"{storm:,}",
            ]
        )
        figures.append(
            {
                "pause_s": restart.pause,
                "failed": failed,
                "back": milliseconds(back),
                "attempts": len(restart.attempts),
                "most_attempts_in_100_ms": storm,
            }
        )
    text = (
        f"{plan.nodes} nodes in {plan.processes} processes; each publishes {plan.rate:g} messages a second,"
        " makes ten calls a second, and has one more call in flight. The broker is killed with SIGKILL."
        " Calls fail: time since the kill, median and maximum. Back: time from the start of the new broker"
        " until a node has received a message and a reply, median and last node. Attempts: connection"
        " attempts since the kill.\n\n" + _totals_text(found)
    )
    return Section(
        key="restart",
        title="the broker is killed under load and restarted",
        text=text,
        heading=[
            "no broker for",
            "calls fail after",
            "back, median",
            "all back",
            "attempts",
            "peak in 100 ms",
        ],
        rows=rows,
        figures={
            "restarts": figures,
            "totals": dict(found.totals),
            "before": dict(found.before),
            "after": dict(found.after),
        },
        failures=_failures(found),
    )


def _totals_text(found: Results) -> str:
    totals, before, after = found.totals, found.before, found.after
    return (
        f"All restarts together: {totals['published']:,} messages published, {totals['received']:,} received,"
        f" {totals['lost_on_break']:,} counted as lost on the break (of which"
        f" {totals['dropped_by_publisher']:,} were dropped by publishers, beyond their depth of 10 while"
        " there was no broker),"
        f" {totals['lost']:,} counted as lost, {totals['dropped_by_reader']:,} dropped by slow readers,"
        f" {totals['unaccounted']:,} unaccounted for, {totals['duplicates']:,} duplicates;"
        f" calls hung: {totals['hung']}. Before and after, in all processes: {before['tasks']:,} and"
        f" {after['tasks']:,} tasks, {before['files']:,} and {after['files']:,} open files,"
        f" {before['memory_kib'] / 1024:,.0f} and {after['memory_kib'] / 1024:,.0f} MiB."
    )


def _failures(found: Results) -> list[str]:
    totals = found.totals
    failures = [
        f"{totals[what]} {words}"
        for what, words in (
            ("unaccounted", "messages are unaccounted for"),
            ("duplicates", "messages arrived twice"),
            ("hung", "calls hung"),
        )
        if totals[what]
    ]
    if found.after["files"] > found.before["files"]:
        failures.append(f"{found.after['files'] - found.before['files']} files were left open")
    return failures
