"""The current directory, as part of the import path."""

from __future__ import annotations

import sys
from pathlib import Path


def look_here() -> None:
    """Let packages in the current directory count, as for a script there."""
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.append(here)
