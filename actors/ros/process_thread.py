"""The thread of a process in which all nodes of rclpy programs live."""

from __future__ import annotations

import os
import threading
from typing import Final

from actors.threads.node_thread import NodeThread

_lock: Final = threading.RLock()
_current: NodeThread | None = None
_pid = 0


def process_thread() -> NodeThread:
    """Return the process's thread; start it unless it runs. It is stopped when the program ends."""
    global _current, _pid
    with _lock:
        if _current is None or _pid != os.getpid() or _current.ended.done():
            _current, _pid = NodeThread("rclpy-nodes").start(), os.getpid()
        return _current
