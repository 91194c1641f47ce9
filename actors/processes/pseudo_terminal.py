"""Pseudo terminals: programs that write to one show colours and progress, as on a real terminal."""

from __future__ import annotations

import os
from contextlib import suppress
from typing import Final

CAN_EMULATE: Final = hasattr(os, "openpty")
"""Whether there are pseudo terminals; not on Windows."""

USUAL_SIZE: Final = (24, 80)
"""Lines and columns if the launch has no terminal itself."""

_OUTPUT_FLAGS: Final = 1
_LOCAL_FLAGS: Final = 3


def open_terminal() -> tuple[int, int]:
    """Return the two ends of a terminal: the reading end gets what is written to the writing end.

    It is as large as the launch's own. It passes bytes on unchanged: it echoes nothing, and does not change
    line ends. When all processes have closed the writing end, reading fails with EIO.

    Raises:
        OSError: The system has none left.
    """
    import termios  # noqa: PLC0415 - Windows has none

    reading, writing = os.openpty()
    try:
        attributes = termios.tcgetattr(writing)
        attributes[_OUTPUT_FLAGS] &= ~termios.OPOST
        attributes[_LOCAL_FLAGS] &= ~termios.ECHO
        termios.tcsetattr(writing, termios.TCSANOW, attributes)
        termios.tcsetwinsize(writing, _size())
    except BaseException:
        os.close(reading)
        os.close(writing)
        raise
    return reading, writing


def _size() -> tuple[int, int]:
    with suppress(OSError):
        columns, lines = os.get_terminal_size()
        if columns and lines:
            return lines, columns
    return USUAL_SIZE
