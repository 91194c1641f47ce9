"""Differential tests: real ROS 2 and callboard get the same program, file or value, and give equal answers.

Real ROS 2 is in build/ros2 (`make test` builds it). One process of it answers the questions of all tests of a
pytest worker, and so does one of callboard's ROS face: the fixtures `real` and `face` of `conftest.py`. Both
run `programs/__main__.py`, and a question is the name of a function there with its arguments.

To compare a program: add a public function without parameters to a module of `programs/` that
`test_programs.py` names, and that imports nothing but rclpy, messages and the standard library. It runs on
both sides, and what it returns (what JSON has) or the type of what it raises is compared.

To compare values or files of a new kind:

1. Write a function with parameters in `programs/` that gives real ROS 2's answer (there it may import all of
   ROS 2).
2. Write `test_KIND.py` with the kind's name. Ask by `real.call("module.function", ...)`; get callboard's
   answer from its own code here, or from the same function by `face.call`.
3. Compare with `agree(KIND, case, real=..., callboard=...)` of `differences.py`. If callboard is different on
   purpose, enter the case there with the reason, and write the reference again:
   python -m tests.actors.ros.rclpy_names > docs/reference/rclpy.md

`python -m tests.real_ros` exits with 0 where real ROS 2 can be installed.
"""

from __future__ import annotations

import platform
import sys
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parent.parent.parent
REAL_PYTHON: Final = ROOT / "build" / "ros2" / "bin" / "python"
PROGRAMS: Final = Path(__file__).with_name("programs")
FOLDERS: Final = ("real_ros", "ros2")
"""Folders of tests that need real ROS 2."""


def is_supported() -> bool:
    """Return whether there are wheels of ROS 2 for this platform and interpreter."""
    here = (sys.platform, platform.machine(), sys.version_info[:2], platform.python_implementation())
    return here == ("linux", "x86_64", (3, 11), "CPython") and platform.libc_ver()[0] == "glibc"
