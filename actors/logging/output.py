"""Format and destination of a script's log lines: ROS 2's format on stderr.

[INFO] [1605120000.123456789] [minimal_publisher]: text
"""

from __future__ import annotations

import logging
import re
import sys
import time
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from actors.config import environment
from actors.logging.severity import ROOT_NAME, LoggingSeverity, severity_from_name
from actors.logging.terminal_text import escape_controls, in_color, log_line
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from typing import TextIO

_LABELS: Final = {logging.WARNING: "WARN", logging.CRITICAL: "FATAL"}


_plain: Final = logging.Formatter()


def stamp_ns(record: logging.LogRecord) -> int:
    """Return when a record was made, in nanoseconds since 1970."""
    # Records of the standard module have no `stamp_ns`, and another library may use the attribute for
    # anything.
    stamp = getattr(record, "stamp_ns", None)
    return stamp if isinstance(stamp, int) else round(record.created * 1e9)


def full_text(record: logging.LogRecord) -> str:
    """Return a record's message, with its traceback and its stack below if it has them."""
    parts = [record.getMessage()]
    if record.exc_info:
        parts.append(_plain.formatException(record.exc_info))
    elif record.exc_text:
        parts.append(record.exc_text)
    if record.stack_info:
        parts.append(_plain.formatStack(record.stack_info))
    return "\n".join(parts)


class RosFormatter(logging.Formatter):
    """Formats any record as ROS 2 does.

    Control characters are escaped, so that received text cannot control a terminal: all of them in names, all
    but line ends and tabs in messages and tracebacks.

    Args:
        color: Whether to colour a line by its level.
        pattern: The line in place of ROS 2's usual one, with ROS 2's names in braces, such as
            "{severity} {name}: {message}"; what else is in braces stays. None: the usual one.
    """

    def __init__(self, *, color: bool = False, pattern: str | None = None) -> None:
        super().__init__()
        self._color = color
        self._pattern = pattern

    def format(self, record: logging.LogRecord) -> str:
        """Return the line, or several if the message has line ends or a traceback.

        Args:
            record: The record.
        """
        label = _LABELS.get(record.levelno, record.levelname)
        name = record.name.removeprefix(ROOT_NAME + ".")
        if self._pattern is None:
            return log_line(label, stamp_ns(record), name, full_text(record), color=self._color)
        line = _PLACE.sub(lambda place: _value(place[1], record, label, name), self._pattern)
        return in_color(line, label) if self._color else line


_PLACE: Final = re.compile(
    "{(severity|name|message|function_name|file_name|line_number|time|time_as_nanoseconds|date_time_with_ms)}"
)


def _value(kind: str, record: logging.LogRecord, label: str, name: str) -> str:
    """Return what a pattern has for a name in braces."""
    stamp = stamp_ns(record)
    seconds, nanoseconds = divmod(stamp, 10**9)
    match kind:
        case "severity":
            value = label
        case "name":
            value = escape(name)
        case "message":
            value = escape_controls(full_text(record))
        case "function_name":
            value = escape(record.funcName or "")
        case "file_name":
            value = escape(record.pathname)
        case "line_number":
            value = str(record.lineno)
        case "time":
            value = f"{seconds}.{nanoseconds:09d}"
        case "date_time_with_ms":
            value = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(seconds))
            value += f".{nanoseconds // 10**6:03d}"
        case _:
            value = str(stamp)
    return value


class _RosHandler(logging.StreamHandler["TextIO"]):
    """The handler that `configure_logging` adds; the type identifies it in later calls."""


# By stream, because `sys.stderr` may be replaced at any time (pytest and `contextlib.redirect_stderr` do).
# Only one is kept: a handler would keep a closed stream alive.
@lru_cache(maxsize=1)
def _handler(stream: TextIO, *, color: bool, pattern: str | None = None) -> _RosHandler:
    handler = _RosHandler(stream)
    handler.setFormatter(RosFormatter(color=color, pattern=pattern))
    return handler


def write_unhandled(record: logging.LogRecord) -> None:
    """Write a record without a handler to stderr, as rclpy's loggers do."""
    if sys.stderr is not None:  # pyright: ignore[reportUnnecessaryComparison] - it is None under pythonw
        _handler(sys.stderr, color=_wants_color(sys.stderr)).handle(record)


def configure_logging(
    level: LoggingSeverity | int | str = LoggingSeverity.INFO,
    *,
    stream: TextIO | None = None,
    color: bool | None = None,
    only_fatal: bool = False,
    pattern: str | None = None,
) -> None:
    """Send all log records of this process to a stream in ROS 2's format. For scripts, not for libraries.

    A later call replaces an earlier one. If the root logger has other handlers and no stream is given, only
    the level is set.

    Args:
        level: Level of callboard's loggers, or its name; UNSET means INFO. Other libraries keep theirs.
        stream: The stream; None: stderr.
        color: Whether to use colours; None: as NO_COLOR and FORCE_COLOR say, else if it is a terminal.
        only_fatal: Whether to write only fatal records of callboard's loggers. The others go to `/rosout` and
            to the program's own handlers nevertheless.
        pattern: The line in place of ROS 2's usual one, as `RosFormatter` gets it.

    Raises:
        ValueError: The level is unknown.
    """
    severity = severity_from_name(level) if isinstance(level, str) else LoggingSeverity(level)
    logging.getLogger(ROOT_NAME).setLevel(int(severity or LoggingSeverity.INFO))
    root = logging.getLogger()
    for handler in [each for each in root.handlers if isinstance(each, _RosHandler)]:
        root.removeHandler(handler)
    # The program has its own idea of where log lines go, and adding ours would print each line twice.
    if root.handlers and stream is None:
        return
    target = sys.stderr if stream is None else stream
    color = _wants_color(target) if color is None else color
    handler = _handler(target, color=color, pattern=pattern)
    handler.filters = [_is_fatal_or_foreign] if only_fatal else []
    root.addHandler(handler)


def _is_fatal_or_foreign(record: logging.LogRecord) -> bool:
    # Lines of other libraries pass: the option is about callboard's loggers (`--disable-stdout-logs` of ROS
    # 2).
    return record.levelno >= logging.CRITICAL or not f"{record.name}.".startswith(ROOT_NAME + ".")


def _wants_color(stream: TextIO) -> bool:
    wish = environment.color_wish()
    return stream.isatty() if wish is None else wish
