"""`launch_xml` for launch files written for ROS 2."""

from __future__ import annotations

from actors.ros.launch_xml import launch_description_sources as launch_description_sources
