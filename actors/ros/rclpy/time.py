"""callboard's `Time`, under rclpy's name."""

from __future__ import annotations

from actors.time.types import Time as Time
from actors.ros.rclpy.imported_names import imported_names

__getattr__ = imported_names(__name__, "ClockType Duration S_TO_NS")
