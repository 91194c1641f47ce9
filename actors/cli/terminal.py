"""How wide the terminal is, without importing shutil: every command asks, and most have milliseconds only."""

from __future__ import annotations

import os
import sys
from typing import Final

USUAL_COLUMNS: Final = 80
"""Where nobody says how many there are."""


def columns() -> int:
    """Return what COLUMNS says, or the terminal at stdout, or else 80."""
    said = os.environ.get("COLUMNS", "")
    if said.isdecimal() and int(said) > 0:
        return int(said)
    try:
        return os.get_terminal_size(sys.stdout.fileno()).columns or USUAL_COLUMNS
    except (AttributeError, OSError, ValueError):
        return USUAL_COLUMNS


def terminal_width() -> int | None:
    """Return how many columns the terminal has; None if stdout is none: a file is as wide as it must be."""
    return columns() if sys.stdout.isatty() else None
