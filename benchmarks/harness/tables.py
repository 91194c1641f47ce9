"""Results as text: figures as median (least to most), and aligned columns."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.cli.bench.results import number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchmarks.harness.results import Spread


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
