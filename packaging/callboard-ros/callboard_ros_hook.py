"""Finds callboard's rclpy for programs written for ROS 2, once they import one of its packages.

Python runs `callboard_ros.pth` at its start, which must take no time: it only compares the names of imports
with those of ROS 2's libraries and the endings of interface packages, and imports this module if one matches.
"""

import sys

from actors.ros import finder


def find_spec(name):
    """Install callboard's finder, and return what it finds.

    None if ROS 2's own rclpy is installed, or callboard does not have the name.
    """
    try:
        finder.install()
    except finder.RealPackageError:
        return None
    found = next(each for each in sys.meta_path if isinstance(each, finder.RosFinder))
    return found.find_spec(name, None)
