"""The class of loggers, for annotations; `rclpy.logging.get_logger` returns them."""

from __future__ import annotations

from actors.logging.logger import Logger as RcutilsLogger

__all__ = ["RcutilsLogger"]
