"""callboard's `Time`, under rclpy's name."""

from __future__ import annotations

from actors.time.types import Time as Time
