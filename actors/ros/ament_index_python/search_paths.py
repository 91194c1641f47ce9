"""Where to search."""

from __future__ import annotations

from actors.tools.prefixes import prefixes


def get_search_paths() -> list[str]:
    """Return the folders that packages are installed in: AMENT_PREFIX_PATH's, and this Python's."""
    return [str(each) for each in prefixes()]
