"""The width of the terminal, without importing shutil, which would slow every command down."""

from __future__ import annotations

import os
import sys
from typing import Final

USUAL_COLUMNS: Final = 80
"""The width if it is unknown."""


def columns() -> int:
    """Return COLUMNS, the width of the terminal at stdout, or 80."""
    variable = os.environ.get("COLUMNS", "")
    if variable.isdecimal() and int(variable) > 0:
        return int(variable)
    try:
        return os.get_terminal_size(sys.stdout.fileno()).columns or USUAL_COLUMNS
    except (AttributeError, OSError, ValueError):
        return USUAL_COLUMNS


def terminal_width() -> int | None:
    """Return the columns of the terminal; None if stdout is no terminal, and has no limit."""
    return columns() if sys.stdout.isatty() else None
