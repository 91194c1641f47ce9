"""The thread of a process in which all nodes of rclpy programs live."""

from __future__ import annotations

import ctypes
import os
import threading
from typing import Final

from actors.threads.node_thread import NodeThread
from proto.aio.process import GROWTH_BYTES, KEPT_BYTES, MAPPED_BYTES

_MALLOC: Final = {-1: KEPT_BYTES, -2: GROWTH_BYTES, -3: MAPPED_BYTES}
"""mallopt(3)'s M_TRIM_THRESHOLD, M_TOP_PAD and M_MMAP_THRESHOLD."""

_lock: Final = threading.RLock()
_current: NodeThread | None = None
_pid = 0


def process_thread() -> NodeThread:
    """Return the process's thread; start it unless it runs. It is stopped when the program ends."""
    global _current, _pid
    with _lock:
        if _current is None or _pid != os.getpid() or _current.ended.done():
            _keep_freed_memory()
            _current, _pid = NodeThread("rclpy-nodes").start(), os.getpid()
        return _current


def _keep_freed_memory() -> None:
    """Let glibc's malloc keep the memory of large messages for the next ones, as in callboard's processes.

    Otherwise each message of 1 MiB costs some 700 page faults, which take three times as long as the rest.
    What a user has set in the environment stays.
    """
    if any(name == "GLIBC_TUNABLES" or name.startswith("MALLOC_") for name in os.environ):
        return
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError, TypeError):  # not glibc, or Windows
        return
    for parameter, value in _MALLOC.items():
        mallopt(parameter, value)
