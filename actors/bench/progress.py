"""A progress bar: one line on a terminal, redrawn in place and removed at the end. Elsewhere nothing."""

from __future__ import annotations

import shutil
import sys
from typing import TYPE_CHECKING, Final, Self

if TYPE_CHECKING:
    from typing import TextIO

    from actors.bench.runner import Progress

BAR_WIDTH: Final = 30
_BACK_AND_CLEAR: Final = "\r\x1b[K"


class ProgressBar:
    """Draws the progress. Use it with `with`, so that the line is always removed."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = sys.stderr if stream is None else stream
        self._draws = self._stream.isatty()

    def __enter__(self) -> Self:
        """Begin."""
        return self

    def __exit__(self, *exc: object) -> None:
        """Remove the line."""
        self._write("")

    def draw(self, progress: Progress) -> None:
        """Draw the current progress."""
        columns = shutil.get_terminal_size().columns
        self._write(line(progress)[: columns - 1])

    def _write(self, text: str) -> None:
        if self._draws:
            self._stream.write(_BACK_AND_CLEAR + text)
            self._stream.flush()


def line(progress: Progress) -> str:
    """Return the text of the bar."""
    full = round(BAR_WIDTH * progress.part)
    minutes, seconds = divmod(round(progress.left_s), 60)
    bar = "#" * full + "-" * (BAR_WIDTH - full)
    return f"[{bar}] {minutes}:{seconds:02} left  {progress.title}"
