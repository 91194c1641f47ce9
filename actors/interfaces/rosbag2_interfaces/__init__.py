"""Interfaces of rosbag2_interfaces."""
