"""The progress of a benchmark, as a line of text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from benchmarks.harness.runner import Progress

BAR_WIDTH: Final = 30


def line(progress: Progress) -> str:
    """Return the text of the bar."""
    full = round(BAR_WIDTH * progress.part)
    minutes, seconds = divmod(round(progress.left_s), 60)
    bar = "#" * full + "-" * (BAR_WIDTH - full)
    return f"[{bar}] {minutes}:{seconds:02} left  {progress.title}"
