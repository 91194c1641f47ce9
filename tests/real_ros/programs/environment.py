"""What is installed on a side."""

from __future__ import annotations

from importlib.metadata import distributions


def versions():
    """Return the versions of ROS 2's distributions by name."""
    found = {each.metadata["Name"]: each.version for each in distributions()}
    return {name: version for name, version in sorted(found.items()) if name.startswith("ros-")}
