"""The process of a program for ROS 2: the memory of its messages."""

from __future__ import annotations

import os
import platform
import subprocess
import sys

import pytest

TIMES, MESSAGES, PAGES_OF_A_MESSAGE = 8, 8, 256
FAULTS = f"""
import resource
from actors.ros.process_thread import process_thread
process_thread()
def faults():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt
before = faults()
for _ in range({TIMES}):
    messages = [b"m" * ({PAGES_OF_A_MESSAGE} * resource.getpagesize()) for _ in range({MESSAGES})]
    del messages
print(faults() - before)
"""


@pytest.mark.processes
@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other C libraries have no mallopt")
@pytest.mark.parametrize("chosen", [False, True])
def test_the_memory_of_large_messages_is_kept_for_the_next_ones(*, chosen: bool) -> None:
    """Not each of them costs page faults for all of its pages, unless the user has configured malloc."""
    unset = {name: value for name, value in os.environ.items() if not name.startswith(("MALLOC_", "GLIBC_"))}
    environment = {**unset, "MALLOC_MMAP_THRESHOLD_": "131072"} if chosen else unset
    run = subprocess.run(
        [sys.executable, "-c", FAULTS],
        env=environment, capture_output=True, text=True, check=True, timeout=60,
    )  # fmt: skip
    assert (int(run.stdout) > TIMES * MESSAGES * PAGES_OF_A_MESSAGE / 2) == chosen
