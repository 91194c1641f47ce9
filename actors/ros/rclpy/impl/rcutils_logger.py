"""The class of loggers, for annotations; `rclpy.logging.get_logger` returns them."""

from __future__ import annotations

from typing import TypeAlias

from actors.logging.logger import Logger
from actors.ros.rclpy.imported_names import imported_names

RcutilsLogger: TypeAlias = Logger

__getattr__ = imported_names(__name__, "Clock LoggingSeverity")
