"""callboard's `Duration`, under rclpy's name."""

from __future__ import annotations

from actors.time.types import INFINITE as Infinite
from actors.time.types import Duration as Duration

__all__ = ["Infinite"]
