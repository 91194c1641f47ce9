"""The files of this machine, for descriptions whose programs import ROS 2's names."""

from __future__ import annotations

import sys
from typing import Final

from actors.launch.resources.files import Files
from actors.ros.finder import is_forced

RUNNER: Final = (sys.executable, "-u", "-m", "actors.ros")
"""Runs a SCRIPT, or PACKAGE EXECUTABLE."""


def ros_files(*, force: bool | None = None) -> Files:
    """Return a library that runs Python programs with ROS 2's names.

    Args:
        force: Whether to run them even if ROS 2's own rclpy is installed; None: as for this process.
    """
    if force is None:
        force = is_forced()
    options = ("--force",) if force else ()
    return Files(runner=(*RUNNER, *options), run_command=("callboard", "run", "--ros", *options))
