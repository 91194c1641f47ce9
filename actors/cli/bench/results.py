"""Runs trials one after another, and returns and prints what came out."""

from __future__ import annotations

import statistics
import sys
from datetime import UTC, datetime
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Final

from actors.cli.bench import machine
from actors.cli.bench.trial import CPU, WORKLOADS, Case, run_trial
from actors.cli.errors import CommandError
from actors.cli.tables import table_lines

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.cli.bench.setup import Setup
    from actors.cli.tables import Style

_BACK_AND_CLEAR: Final = "\r\x1b[K"
_MANY: Final = 100
"""From here on decimals say nothing."""


async def measure(
    workloads: Sequence[str], setup: Setup, *, seconds: float, repetitions: int
) -> dict[str, Any]:
    """Run trials, and show on a terminal which one runs.

    Args:
        workloads: Their names; none for the quick cases of all.
        setup: How broker and roles are run.
        seconds: The length of each load.
        repetitions: Trials of each case. They are outermost, so that other load on the machine affects all
            cases.

    Returns:
        The document that docs/reference/json.md describes.
    """
    samples: list[dict[str, Any]] = []
    failures: list[dict[str, Any]] = []
    began = datetime.now(UTC).isoformat(timespec="seconds")
    trials = [(name, case, number) for number in range(repetitions) for name, case in _chosen(workloads)]
    try:
        for done, (name, case, number) in enumerate(trials):
            _show(f"{done} of {len(trials)} trials done: {name} {case.name}")
            where = {"workload": name, "case": case.name, "contender": str(setup), "repetition": number}
            try:
                samples.append({**where, "figures": await run_trial(setup, case, seconds)})
            except (CommandError, OSError) as error:
                failures.append({**where, "reason": str(error)})
    finally:
        _show("")
    return {
        "machine": machine.describe(),
        "date": began,
        "command": " ".join(["callboard bench", *workloads]),
        "seconds": seconds,
        "repetitions": repetitions,
        "entrants": [{"name": str(setup), "version": version("callboard"), "brokered": True}],
        "skipped": {},
        "samples": samples,
        "failures": failures,
        "medians": _medians(samples),
    }


def report(document: dict[str, Any]) -> list[str]:
    """Return a table for each workload: its figures, then CPU time by role, as median (least to most)."""
    lines: list[str] = []
    for name, workload in WORKLOADS.items():
        found = {each["case"]: each["figures"] for each in document["medians"] if each["workload"] == name}
        if not found:
            continue
        cpu = dict.fromkeys(key for figures in found.values() for key in figures if key.startswith(CPU))
        titles = {**workload.figures, **{key: f"{key.removeprefix(CPU)} us CPU" for key in cpu}}
        rows = [[case, *(_spread(figures.get(key)) for key in titles)] for case, figures in found.items()]
        counts: list[Style] = ["count"] * len(titles)
        table = table_lines(rows, header=["", *titles.values()], style=["name", *counts])
        lines += [f"{name}  {workload.title}", *(f"    {line}" for line in table), ""]
    return lines[:-1]


def _chosen(workloads: Sequence[str]) -> list[tuple[str, Case]]:
    if workloads:
        return [(name, case) for name in WORKLOADS if name in workloads for case in WORKLOADS[name].cases]
    return [(name, case) for name, each in WORKLOADS.items() for case in each.cases[: each.quick]]


def _medians(samples: list[dict[str, Any]]) -> list[dict[str, Any]]:
    grouped: dict[tuple[str, str, str], dict[str, list[float]]] = {}
    for sample in samples:
        figures = grouped.setdefault((sample["workload"], sample["case"], sample["contender"]), {})
        for key, value in sample["figures"].items():
            figures.setdefault(key, []).append(value)
    return [
        {
            "workload": workload,
            "case": case,
            "contender": contender,
            "figures": {
                key: {"median": statistics.median(values), "least": min(values), "most": max(values)}
                for key, values in figures.items()
            },
        }
        for (workload, case, contender), figures in grouped.items()
    ]


def _spread(figure: dict[str, float] | None) -> str:
    if figure is None:
        return "-"
    median, least, most = (number(figure[key]) for key in ("median", "least", "most"))
    return median if least == most else f"{median} ({least} to {most})"


def number(value: float) -> str:
    """Return a figure with about three significant digits."""
    if abs(value) >= _MANY:
        return f"{value:,.0f}"
    return f"{value:.1f}" if abs(value) >= 10 or value == int(value) else f"{value:.2f}"


def _show(text: str) -> None:
    """Replace the line on the terminal."""
    if sys.stderr.isatty():
        sys.stderr.write(_BACK_AND_CLEAR + text)
        sys.stderr.flush()
