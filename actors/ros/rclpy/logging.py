"""Loggers by name."""

from __future__ import annotations

from actors.logging.logger import Logger as RcutilsLogger
from actors.logging.logger import LoggingSeverity as LoggingSeverity
from actors.logging.logger import get_logger as get_logger
from actors.logging.logger import severity_from_name

__all__ = ["RcutilsLogger"]


def set_logger_level(name: str, level: LoggingSeverity | int, detailed_error: bool = False) -> bool:
    """Set the lowest level at which a logger logs; return True."""
    del detailed_error
    get_logger(name).set_level(LoggingSeverity(level))
    return True


def get_logger_effective_level(name: str) -> LoggingSeverity:
    """Return the level of a logger, or of the nearest above it that has one."""
    return get_logger(name).get_effective_level()


def get_logging_severity_from_string(log_severity: str) -> LoggingSeverity:
    """Return the level of a name such as "INFO"."""
    return severity_from_name(log_severity)
