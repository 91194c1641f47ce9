"""Where to search: first where packages are installed, then in callboard's own interface packages."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.ros.interface_resources import interface_prefix
from actors.tools.prefixes import prefixes

if TYPE_CHECKING:
    from pathlib import Path


def get_search_paths() -> list[str]:
    """Return the folders that packages are installed in.

    AMENT_PREFIX_PATH's, this Python's, and that of callboard's interface packages.
    """
    return [str(each) for each in search_folders()]


def search_folders() -> list[Path]:
    """Return the same as paths."""
    return [*prefixes(), interface_prefix()]
