"""How much memory an action allocates."""

from __future__ import annotations

import tracemalloc
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

TRIES = 3
"""Coverage and caches of the interpreter allocate, too, but not each time."""


def peak_bytes(action: Callable[[], object]) -> int:
    """Run an action several times; return the smallest peak of memory that it allocated."""
    return min(peak_bytes_once(action) for _ in range(TRIES))


def peak_bytes_once(action: Callable[[], object]) -> int:
    """Run an action once, as when later runs would find its results in a cache; return the peak of memory."""
    tracemalloc.start()
    try:
        action()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
