"""What a process that is callboard's own sets up before it runs: event loop, allocator, garbage collector.

Only the daemon and `actors.run` own their process and call this; a library must leave these to its host.
"""

from __future__ import annotations

import asyncio
import ctypes
import gc
import os
from typing import Final

_M_TRIM_THRESHOLD: Final = -1
_M_TOP_PAD: Final = -2
_M_MMAP_THRESHOLD: Final = -3
"""mallopt(3)'s parameters, from glibc's malloc.h."""

KEPT_BYTES: Final = 64 * 1024 * 1024
"""Free memory at the heap's end that is not given back at once. A message of some tens of KiB otherwise has
the heap's end given back and asked for again, page by page: a third of all time at 64 KiB messages."""

MAPPED_BYTES: Final = 32 * 1024 * 1024
"""Blocks up to this size (the most that glibc allows) come from the heap, for the same reason."""

GROWTH_BYTES: Final = 1024 * 1024
"""The heap grows by this much at a time."""


def open_streams() -> None:
    """Let stdin, stdout and stderr lead nowhere if the shell has closed them (<&- >&-).

    Otherwise sockets and pipes would take their numbers, and get what is printed; uvloop aborts then.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)  # noqa: FBT003 - it has no name


def new_event_loop() -> asyncio.AbstractEventLoop:
    """Return a new event loop: uvloop's where there is one. Closed streams are opened before."""
    open_streams()
    try:
        import uvloop  # noqa: PLC0415 - not on every platform
    except ImportError:
        return asyncio.new_event_loop()
    return uvloop.new_event_loop()


def configure_process() -> None:
    """Tell the allocator and the garbage collector that this process is loaded and starts to work.

    What has been imported lives as long as the process: the collector need not look at it again.
    """
    gc.collect()
    gc.freeze()
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError, TypeError):  # not glibc, or Windows
        return
    mallopt(_M_TRIM_THRESHOLD, KEPT_BYTES)
    mallopt(_M_TOP_PAD, GROWTH_BYTES)
    mallopt(_M_MMAP_THRESHOLD, MAPPED_BYTES)
