"""Loggers by name."""

from __future__ import annotations

from typing import TypeAlias

import logging as standard
from pathlib import Path

from actors.config.environment import foreign_variables
from actors.logging.severity import ROOT_NAME, severity_from_name
from actors.logging.logger import Logger
from actors.logging.severity import LoggingSeverity as LoggingSeverity
from actors.logging.logger import get_logger as get_logger

RcutilsLogger: TypeAlias = Logger

_root_logger = RcutilsLogger()
"""The logger above all others. Programs use it, although its name is private."""


def initialize() -> None:
    """Do nothing: callboard's logging needs no preparation."""


def shutdown() -> None:
    """Do nothing: callboard's logging needs no end."""


def clear_config() -> None:
    """Give all loggers their first levels again: INFO for all."""
    for name in tuple(standard.Logger.manager.loggerDict):
        if name.startswith(f"{ROOT_NAME}."):
            standard.getLogger(name).setLevel(standard.NOTSET)
    standard.getLogger(ROOT_NAME).setLevel(standard.INFO)


def set_logger_level(name: str, level: LoggingSeverity | int, detailed_error: bool = False) -> None:
    """Set the lowest level at which a logger logs; "" is the one above all others."""
    del detailed_error
    RcutilsLogger(name).set_level(level)


def get_logger_level(name: str) -> LoggingSeverity:
    """Return the level that a logger has itself; UNSET if it has none."""
    level = standard.getLogger(f"{ROOT_NAME}.{name}" if name else ROOT_NAME).level
    return next((each for each in LoggingSeverity if each >= level), LoggingSeverity.FATAL)


def get_logger_effective_level(name: str) -> LoggingSeverity:
    """Return the level of a logger, or of the nearest above it that has one."""
    return RcutilsLogger(name).get_effective_level()


def get_logging_severity_from_string(log_severity: str) -> LoggingSeverity:
    """Return the level of a name such as "INFO".

    Raises:
        RuntimeError: There is no such level.
    """
    try:
        return severity_from_name(log_severity)
    except ValueError as error:
        raise RuntimeError(str(error)) from None


def get_logging_directory() -> Path:
    """Return the folder for log files: `ROS_LOG_DIR`, `log` in `ROS_HOME`, or `~/.ros/log`.

    Nodes write no log files; programs may.
    """
    variables = foreign_variables()
    folder = variables.get("ROS_LOG_DIR") or Path(variables.get("ROS_HOME") or "~/.ros", "log")
    return Path(folder).expanduser()
