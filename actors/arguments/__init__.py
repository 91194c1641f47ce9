"""ROS 2's command-line arguments (`--ros-args`), and the remapping rules among them.

Imports logging, parameters and proto.
"""
