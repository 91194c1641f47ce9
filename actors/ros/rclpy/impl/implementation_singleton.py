"""`rclpy_implementation`: rclpy's C library there, of which callboard has the errors only."""

from __future__ import annotations

from actors.ros.rclpy import _rclpy_pybind11

rclpy_implementation = _rclpy_pybind11
