"""Run the tests of packages in checkouts, with callboard's face in rclpy's place: a part of `make upstream`.

    git clone https://github.com/splintered-reality/py_trees_ros checkouts/py_trees_ros
    git clone https://github.com/splintered-reality/py_trees_ros_interfaces checkouts/py_trees_ros_interfaces
    git clone https://github.com/RobotWebTools/rosbridge_suite checkouts/rosbridge_suite
    git clone https://github.com/ros2/geometry2 checkouts/geometry2

Nothing is built: `tf2_py`, which is C++, has a stand-in below `stand_ins/`, without interpolation and chains.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Final, NamedTuple

from tests.upstream.distributions import WORK, Judge, environment, run_tests

STAND_INS: Final = Path(__file__).with_name("stand_ins")
PLUGINS: Final = ("--timeout=60", "-p", "no:cacheprovider")
REQUIREMENTS: Final = (
    "argcomplete",
    "psutil",
    "py-trees",
    "pydot",
    "cbor2",
    "numpy",
    "pymongo",
    "Pillow",
    "tornado",
)
"""What the packages import that ROS 2 has from elsewhere."""


class Suite(NamedTuple):
    """The tests of a package.

    Attributes:
        judge: The package, and what is expected.
        folder: The package's folder below the checkouts.
        paths: Folders to import from, below the checkouts.
    """

    judge: Judge
    folder: str
    paths: tuple[str, ...]


SUITES: Final = (
    Suite(
        Judge("py_trees_ros", 15, ("tests", *PLUGINS)),
        "py_trees_ros",
        # The folder of the checkouts has the package of interfaces.
        (
            *("", "py_trees_ros", "geometry2/tf2_ros_py", "ros2cli/ros2cli", "ros2cli/ros2topic"),
            *("ros2cli/ros2service", "ros2cli/ros2node"),
        ),
    ),
    # Two compare what the stand-in does not do; two ask for a server as soon as the client is made.
    Suite(Judge("tf2_ros", 7, ("test", *PLUGINS)), "geometry2/tf2_ros_py", ("geometry2/tf2_ros_py",)),
    # Three need control_msgs; two expect others to be done within 0.1 s.
    Suite(
        Judge("rosbridge_library", 130, ("test/internal", "test/capabilities", *PLUGINS)),
        "rosbridge_suite/rosbridge_library",
        ("rosbridge_suite", "rosbridge_suite/rosbridge_library/src"),
    ),
)


def main(checkouts: Path) -> int:
    """Print how many tests of each package pass; return 1 if they are fewer than before."""
    found = [each for each in SUITES if (checkouts / each.folder).is_dir()]
    for suite in SUITES:
        if suite not in found:
            print(f"missing  {suite.judge.requirement}: no {suite.folder} in {checkouts}")
    if not found:
        return 0
    python = environment(*REQUIREMENTS)
    WORK.mkdir(exist_ok=True)
    return max(
        run_tests(
            python,
            suite.judge,
            checkouts / suite.folder,
            WORK / f"{suite.judge.requirement}.xml",
            (STAND_INS, *(checkouts / path for path in suite.paths)),
        )
        for suite in found
    )


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
