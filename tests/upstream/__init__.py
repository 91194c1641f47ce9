"""Runs programs of a checkout of ROS 2's examples and demos, and says which behave as upstream."""
