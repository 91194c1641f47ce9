"""Results as lines of text: a table for each workload, figures as median (least to most)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.bench.outcomes import CPU

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.bench.results import Results, Spread
    from actors.bench.workloads import Workload

MANY: Final = 100
"""From here on decimals say nothing."""


def number(value: float) -> str:
    """Return a figure with about three significant digits."""
    if abs(value) >= MANY:
        return f"{value:,.0f}"
    return f"{value:.1f}" if abs(value) >= 10 or value == int(value) else f"{value:.2f}"


def shown(figure: Spread | None) -> str:
    """Return "median (least to most)", the median alone if there is no spread, a dash without a figure."""
    if figure is None:
        return "-"
    if figure.least == figure.most:
        return number(figure.median)
    return f"{number(figure.median)} ({number(figure.least)} to {number(figure.most)})"


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows of cells as lines: the first column to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            cell.rjust(width) if index else cell.ljust(width)
            for index, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


def workload_rows(results: Results, workload: Workload, contender: str) -> list[list[str]]:
    """Return a heading and one row for each case that has figures: its figures, then CPU by role."""
    found = {case.name: results.figures(workload.id, case.name, contender) for case in workload.cases}
    found = {name: figures for name, figures in found.items() if figures}
    roles = list(dict.fromkeys(key for figures in found.values() for key in figures if key.startswith(CPU)))
    columns = [(each.key, each.title) for each in workload.figures]
    columns += [(role, f"{role.removeprefix(CPU)} us CPU") for role in roles]
    return [
        ["", *(title for _, title in columns)],
        *([name, *(shown(figures.get(key)) for key, _ in columns)] for name, figures in found.items()),
    ]


def report(results: Results, workloads: Sequence[Workload], contender: str) -> list[str]:
    """Return the lines of a whole run of one contender."""
    lines: list[str] = []
    for workload in workloads:
        rows = workload_rows(results, workload, contender)
        if len(rows) > 1:
            lines += [f"{workload.id}  {workload.title}", *(f"    {line}" for line in aligned(rows)), ""]
    return lines[:-1]
