"""What another process uses, told by the system: CPU time, memory and open files, by its id.

Linux tells both; elsewhere psutil does, if it is there. Where nobody tells, the answer is None.
"""

from __future__ import annotations

import os
import re
from importlib import import_module
from pathlib import Path
from typing import Any

_PSS = re.compile(r"^Pss:\s+(\d+) kB$", re.MULTILINE)


def cpu_s(pid: int) -> float | None:
    """Return the CPU time (user and system, all threads) that a process has used, in seconds."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text("ascii", "replace")
    except OSError:
        times = _asked(pid, "cpu_times")
        return None if times is None else float(times.user + times.system)
    # The name in parentheses may contain anything, so fields are counted behind it.
    fields = text.rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory_kib(pid: int) -> float | None:
    """Return the memory of a process in KiB, shared pages counted in part where the system says so."""
    try:
        found = _PSS.search(Path(f"/proc/{pid}/smaps_rollup").read_text("ascii"))
    except OSError:
        found = None
    if found is not None:
        return float(found[1])
    memory = _asked(pid, "memory_info")
    return None if memory is None else memory.rss / 1024


def open_files(pid: int) -> int | None:
    """Return how many descriptors a process has open: its connections are among them."""
    try:
        return sum(1 for _ in Path(f"/proc/{pid}/fd").iterdir())
    except OSError:
        count = _asked(pid, "num_fds")
        return None if count is None else int(count)


def _asked(pid: int, what: str) -> Any:
    try:
        psutil: Any = import_module("psutil")
    except ImportError:
        return None
    try:
        return getattr(psutil.Process(pid), what)()
    except (psutil.Error, AttributeError):  # not everything is told everywhere
        return None
