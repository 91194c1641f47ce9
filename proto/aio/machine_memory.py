"""The memory of the machine or its container, and how much of it this process uses."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

FALLBACK_BYTES: Final = 4 * 1024**3
"""Memory to assume if the machine does not report it."""

_CGROUPS: Final = Path("/sys/fs/cgroup")


def memory_bytes() -> int:
    """Return the memory that this process may use: the machine's, or the limit of its control group."""
    try:
        found = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # Windows
        found = FALLBACK_BYTES
    return min([found, *_cgroup_limits()])


def _cgroup_limits() -> list[int]:
    """Return the limits of the control groups, version 1 or 2, that this process is in."""
    files = [_CGROUPS / "memory/memory.limit_in_bytes", _CGROUPS / "memory.max"]
    try:
        lines = Path("/proc/self/cgroup").read_text().splitlines()
    except OSError:
        lines = []
    for line in lines:
        _, controllers, path = line.split(":", 2)
        if "memory" in controllers.split(","):
            top, name = _CGROUPS / "memory", "memory.limit_in_bytes"
        elif not controllers:
            top, name = _CGROUPS, "memory.max"
        else:
            continue
        group = top / path.lstrip("/")
        files += [each / name for each in (group, *group.parents) if top in each.parents]
    limits: list[int] = []
    for file in files:
        try:
            limits.append(int(file.read_text()))
        except (OSError, ValueError):  # no such group, or "max"
            continue
    return [limit for limit in limits if limit > 0]


def resident_bytes() -> int | None:
    """Return how much memory this process uses; None if the system does not report it."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, IndexError, AttributeError):
        return None
