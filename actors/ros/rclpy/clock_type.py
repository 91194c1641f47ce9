"""callboard's `ClockType`, under rclpy's name."""

from __future__ import annotations

from actors.time.types import ClockType as ClockType
