"""The levels of a process's loggers for other nodes: `~/get_logger_levels` and `~/set_logger_levels`.

They answer as rclpy's do: the level is a logger's own, UNSET (0) if it inherits its parent's or is unknown,
and the empty name is the logger above all.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any, Final

from actors.endpoints.service.idle import IdleService
from actors.interfaces.rcl_interfaces.msg import LoggerLevel, SetLoggerLevelsResult
from actors.interfaces.rcl_interfaces.srv import GetLoggerLevels, SetLoggerLevels
from actors.logging.severity import ROOT_NAME, LoggingSeverity
from proto.errors import InvalidServiceNameError

if TYPE_CHECKING:
    from actors.arguments.remapping import Remapper
    from actors.endpoints.context import NodeContext

MAX_ITEMS: Final = 1000
"""Loggers in one request. One with more is answered with an empty list."""
MAX_NEW_LOGGERS: Final = 1000
"""Loggers that a node's service makes in all: Python keeps them for as long as the process runs."""
MAX_NAME: Final = 1024
"""Characters of the name of a logger that the service makes."""


class LoggerServices:
    """The logger services of one node.

    Args:
        context: The node.
        names: Expands and remaps the names.
    """

    def __init__(self, context: NodeContext, names: Remapper) -> None:
        self._made = 0
        kinds: list[tuple[str, Any, Any]] = [
            ("get_logger_levels", GetLoggerLevels, self._get),
            ("set_logger_levels", SetLoggerLevels, self._set),
        ]
        try:
            for name, kind, callback in kinds:
                full_name = names.resolve_service(f"~/{name}")
                # Concurrent, so that the log level of a node can be raised while one of its callbacks does
                # not end.
                IdleService(context, kind, full_name, callback=callback, concurrent=True)
        except InvalidServiceNameError as error:
            context.log.warning(f"The node's name is too long for logger services: {error}")

    def _get(self, request: GetLoggerLevels.Request) -> GetLoggerLevels.Response:
        names = request.names if len(request.names) <= MAX_ITEMS else []
        return GetLoggerLevels.Response(levels=[LoggerLevel(name=name, level=_level(name)) for name in names])

    def _set(self, request: SetLoggerLevels.Request) -> SetLoggerLevels.Response:
        levels = request.levels if len(request.levels) <= MAX_ITEMS else []
        reasons = [self._set_one(each) for each in levels]
        return SetLoggerLevels.Response(
            results=[SetLoggerLevelsResult(successful=not reason, reason=reason) for reason in reasons]
        )

    def _set_one(self, wanted: LoggerLevel) -> str:
        """Set a level, or return why not."""
        try:
            severity = LoggingSeverity(wanted.level)
        except ValueError:
            return "Failed reason: Invalid logger level."
        # Anybody with the right to call this can make up names, and Python never frees a logger.
        if _existing(wanted.name) is None:
            if len(wanted.name) > MAX_NAME:
                return f"The name has more than {MAX_NAME} characters"
            if self._made >= MAX_NEW_LOGGERS:
                return f"More than {MAX_NEW_LOGGERS} new loggers"
            self._made += 1
        if not wanted.name:
            severity = severity or LoggingSeverity.INFO  # the logger above all has none to inherit from
        logging.getLogger(_full_name(wanted.name)).setLevel(int(severity))
        return ""


def _full_name(name: str) -> str:
    return f"{ROOT_NAME}.{name}" if name else ROOT_NAME


def _existing(name: str) -> logging.Logger | None:
    """Return a logger if there is one, without making it."""
    # Not `getLogger`, which would make it: a mere question must not use memory for ever.
    found = logging.Logger.manager.loggerDict.get(_full_name(name))
    return found if isinstance(found, logging.Logger) else None


def _level(name: str) -> LoggingSeverity:
    logger = _existing(name)
    if logger is None:
        return LoggingSeverity.UNSET
    return next((each for each in LoggingSeverity if each >= logger.level), LoggingSeverity.FATAL)
