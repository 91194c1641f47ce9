"""Scripts that tests start as processes, and what they need to know of a process."""

from __future__ import annotations

import asyncio
import os
import re
import sys

from tests.integration.conftest import DEADLINE_SEC

SLEEPER = """
import os, time
os.write(1, b"sleeper %d\\n" % os.getpid())
time.sleep(1000)
"""

DEAF = """
import os, signal, time
signal.signal(signal.SIGINT, signal.SIG_IGN)
{more}
os.write(1, b"deaf %d\\n" % os.getpid())
while True:
    time.sleep(1000)
"""

PARENT = """
import os, subprocess, sys, time
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(1000)"])
os.write(1, b"parent %d %d\\n" % (os.getpid(), child.pid))
time.sleep(1000)
"""


def is_alive(pid: int) -> bool:
    """Return whether a process runs; a zombie does not."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    if sys.platform != "linux":
        return True
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii") as file:  # noqa: PTH123 - in a line
            return file.read().rpartition(")")[2].split()[0] not in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return False


async def wait_until_dead(*pids: int) -> None:
    """Wait until processes that are not children of this one have ended."""
    async with asyncio.timeout(DEADLINE_SEC):
        while any(is_alive(pid) for pid in pids):
            await asyncio.sleep(0.01)


def pids_in(line: str) -> list[int]:
    """Return the numbers in a line that a script has printed, without those in a label such as "[name-1]"."""
    return [int(word) for word in re.findall(r"(?<![-\w])\d+\b", line)]
