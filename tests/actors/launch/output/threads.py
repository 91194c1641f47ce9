"""Waiting for the threads that write output and log files."""

from __future__ import annotations

import threading
from typing import Final

DEADLINE_SEC: Final = 60.0


def join_threads(name: str) -> None:
    """Wait until all threads of a name have ended."""
    for thread in threading.enumerate():
        if thread.name == name:
            thread.join(DEADLINE_SEC)
