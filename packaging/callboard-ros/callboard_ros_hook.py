"""Finds callboard's rclpy for programs written for ROS 2, once they import one of its packages.

`callboard_ros.pth`, which Python runs at its start, only compares names, as that must cost nothing: those of
ROS 2's libraries, and what the names of interface packages end in. It imports this module for such a name.
"""

import sys

from actors.ros import finder


def find_spec(name):
    """Return what callboard's finder finds, which is first from then on.

    It is None if ROS 2's own rclpy is installed, or callboard has no such name.
    """
    try:
        finder.install()
    except finder.RealPackageError:
        return None
    found = next(each for each in sys.meta_path if isinstance(each, finder.RosFinder))
    return found.find_spec(name, None)
