"""The edge of the bridge to ROS 2: all that touches rclpy.

It runs in one asyncio loop, without an executor and without a thread (see `arrivals.py`). It
imports rclpy, and what bridges share; nothing imports it but the command that runs the bridge.
"""
