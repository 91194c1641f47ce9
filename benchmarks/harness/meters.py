"""CPU time, memory and open files of another process, by its id.

They come from /proc on Linux, elsewhere from psutil if it is installed; otherwise the result is None.
"""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

from actors.cli.bench import machine

_PSS = re.compile(r"^Pss:\s+(\d+) kB$", re.MULTILINE)


def cpu_s(pid: int) -> float | None:
    """Return the CPU time (user and system, all threads) that a process has used, in seconds."""
    used = machine.cpu_s(pid)
    if used is not None:
        return used
    times = _psutil(pid, "cpu_times")
    return None if times is None else float(times.user + times.system)


def memory_kib(pid: int) -> float | None:
    """Return the memory of a process in KiB, with a share of shared pages where the system knows it."""
    try:
        found = _PSS.search(Path(f"/proc/{pid}/smaps_rollup").read_text("ascii"))
    except OSError:
        found = None
    if found is not None:
        return float(found[1])
    memory = _psutil(pid, "memory_info")
    return None if memory is None else memory.rss / 1024


def open_files(pid: int) -> int | None:
    """Return how many descriptors a process has open, connections included."""
    try:
        return sum(1 for _ in Path(f"/proc/{pid}/fd").iterdir())
    except OSError:
        count = _psutil(pid, "num_fds")
        return None if count is None else int(count)


def _psutil(pid: int, method: str) -> Any:
    try:
        psutil: Any = import_module("psutil")
    except ImportError:
        return None
    try:
        return getattr(psutil.Process(pid), method)()
    except (psutil.Error, AttributeError):  # not every system has every figure
        return None
