"""Severities of log lines, and the standard logger whose level holds for all of callboard's."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

ROOT_NAME: Final = "callboard"
"""Name of the standard logger above all of callboard's."""


class LoggingSeverity(IntEnum):
    """Severity of a message; the numbers are those of rclpy and of the standard `logging` module."""

    UNSET = 0
    DEBUG = 10
    INFO = 20
    WARN = 30
    ERROR = 40
    FATAL = 50


def severity_from_name(name: str) -> LoggingSeverity:
    """Return the severity of a name, in any case.

    Raises:
        ValueError: The name is unknown; the text lists the known ones.
    """
    try:
        return LoggingSeverity[name.upper()]
    except KeyError:
        words = ", ".join(severity.name for severity in LoggingSeverity)
        raise ValueError(f"{name!r} is not a log level, expected one of {words}") from None
