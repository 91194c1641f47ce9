"""callboard's `Duration`, under rclpy's name."""

from __future__ import annotations

from actors.time.types import INFINITE
from actors.time.types import Duration as Duration
from actors.ros.rclpy.imported_names import imported_names

Infinite = INFINITE

__getattr__ = imported_names(__name__, "S_TO_NS")
