"""Configuration of callboard's own processes: event loop, signals, memory allocator, garbage collector.

Only the daemon and `actors.run` own their process and call this; a library leaves these to its host.
"""

from __future__ import annotations

import asyncio
import ctypes
import gc
import os
import signal
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

_M_TRIM_THRESHOLD: Final = -1
_M_TOP_PAD: Final = -2
_M_MMAP_THRESHOLD: Final = -3
"""mallopt(3)'s parameters, from glibc's malloc.h."""

KEPT_BYTES: Final = 64 * 1024 * 1024
"""Free memory at the end of the heap that malloc keeps. Otherwise each message of some tens of KiB returns
pages to the kernel and requests them again, which takes a third of the time with 64 KiB messages."""

MAPPED_BYTES: Final = 32 * 1024 * 1024
"""Blocks up to this size (glibc's maximum) come from the heap and not from mmap, for the same reason."""

GROWTH_BYTES: Final = 1024 * 1024
"""The heap grows by this much at a time."""

FULL_COLLECTION_AFTER: Final = 1000
"""Collections of the middle generation before a full one; Python's default is 10. A full one then follows
about 7 million new objects."""

_trims: Final[list[Callable[[int], object]]] = []
"""glibc's malloc_trim, once `configure_process` has found it."""

MANY_FILES: Final = 2**31
"""The limit of open files where the system has none."""


def open_streams() -> None:
    """Open the null device as stdin, stdout and stderr where the shell has closed them (<&- >&-).

    Otherwise a socket or pipe would get such a number and receive printed text; uvloop aborts in that case.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)  # noqa: FBT003 - it has no name


def new_event_loop() -> asyncio.AbstractEventLoop:
    """Return a new event loop, uvloop's where it is installed, after `open_streams`."""
    open_streams()
    try:
        import uvloop  # noqa: PLC0415 - not on every platform
    except ImportError:
        return asyncio.new_event_loop()
    return uvloop.new_event_loop()


def add_signal_handler(loop: asyncio.AbstractEventLoop, number: int, callback: Callable[[], object]) -> None:
    """Call `callback` in the loop at a signal, also where the loop cannot handle signals (Windows)."""
    try:
        loop.add_signal_handler(number, callback)
    except NotImplementedError:
        signal.signal(number, lambda _number, _frame: loop.call_soon_threadsafe(callback))


def raise_file_limit(wanted: int | None = None) -> int:
    """Raise the soft limit of open files, which child processes inherit.

    Args:
        wanted: The limit that is needed. A higher one stays; None: as high as the system allows.

    Returns:
        The soft limit from now on; `MANY_FILES` where there is none.
    """
    try:
        import resource  # noqa: PLC0415 - not on Windows
    except ImportError:
        return MANY_FILES
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    now, most = (MANY_FILES if each == resource.RLIM_INFINITY else each for each in (soft, hard))
    limit = most if wanted is None else min(most, wanted)
    if limit <= now:
        return now
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (limit, hard))
    except (ValueError, OSError):  # macOS has a lower limit beside the one that it reports
        return now
    return limit


def configure_process() -> None:
    """Tune the garbage collector and the allocator; call it once, after the imports.

    Objects that exist at this point live as long as the process, so the collector skips them from now on.
    """
    gc.collect()
    gc.freeze()
    try:
        libc = ctypes.CDLL(None)
        mallopt = libc.mallopt
        _trims.append(libc.malloc_trim)
    except (OSError, AttributeError, TypeError):  # not glibc, or Windows
        return
    mallopt(_M_TRIM_THRESHOLD, KEPT_BYTES)
    mallopt(_M_TOP_PAD, GROWTH_BYTES)
    mallopt(_M_MMAP_THRESHOLD, MAPPED_BYTES)


def make_full_collections_rare() -> None:
    """Make full garbage collections rare, because one takes 60 ms for a million objects.

    For a process whose long-lived objects are in no reference cycles, and so are freed without the collector.
    """
    gc.set_threshold(*gc.get_threshold()[:2], FULL_COLLECTION_AFTER)


def return_memory() -> None:
    """Return freed memory that malloc keeps to the system, if `configure_process` has configured malloc.

    It takes some milliseconds for each 100 MiB: call it seldom.
    """
    for trim in _trims[:1]:
        trim(0)
