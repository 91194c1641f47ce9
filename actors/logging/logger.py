"""rclpy's loggers on top of the standard `logging` module.

A logger named `ns.node` writes to `logging.getLogger("callboard.ns.node")`, so the program's handlers get its
records. If neither that logger nor a parent has a handler, records are written to stderr in ROS 2's format,
without adding a handler. To silence them, add a `logging.NullHandler` to the `callboard` logger; scripts that
want more call `configure_logging`. The level of the `callboard` logger is INFO at first, as in ROS 2, and
other loggers inherit it.

The sinks of a logger (`sinks.py`) get the same records. What a program logs with the standard module itself
goes to handlers only.
"""

from __future__ import annotations

import logging
import sys
import time
from functools import cache
from typing import TYPE_CHECKING, Any, Final, Protocol, TypedDict, Unpack

from actors.logging.output import write_unhandled
from actors.logging.severity import ROOT_NAME, LoggingSeverity
from actors.logging.sinks import sinks_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import CodeType

_PREFIX: Final = ROOT_NAME + "."


_DEBUG: Final = 10
_INFO: Final = 20
_WARN: Final = 30
_ERROR: Final = 40
_FATAL: Final = 50

_top = logging.getLogger(ROOT_NAME)
# A level that the program has set before it imported callboard stays.
if _top.level == logging.NOTSET:
    _top.setLevel(logging.INFO)


def node_logger_name(full_name: str) -> str:
    """Return the logger name of a node's full name: `/my_ns/my_node` gives `my_ns.my_node`."""
    return full_name.strip("/").replace("/", ".")


class _Time(Protocol):
    @property
    def nanoseconds(self) -> int: ...


class ThrottleClock(Protocol):
    """A clock that throttles log calls, such as a node's."""

    def now(self) -> _Time:
        """Return the current time."""
        ...


class LogOptions(TypedDict, total=False):
    """Options of a log call. Filters belong to the calling line of code."""

    once: bool
    """Log only the first call."""
    skip_first: bool
    """Log all calls but the first."""
    throttle_duration_sec: float
    """Log at most once per this many seconds."""
    throttle_time_source_type: ThrottleClock
    """The clock for that; without it the monotonic one."""
    exc_info: BaseException | None
    """Add this exception's traceback."""


MAX_FILTERS: Final = 1000
"""Lines of code whose filters a logger keeps; beyond it the oldest are reset. Only generated code needs so
many."""

_KNOWN_OPTIONS: Final = LogOptions.__annotations__.keys()


class _Site:
    """State of the filters of one line of code."""

    __slots__ = ("_done", "_last_sec", "_once", "_skip_first", "_skipped", "_throttle_sec", "clock", "level")

    def __init__(self, level: int, options: LogOptions) -> None:
        self.level = level
        self.clock = options.get("throttle_time_source_type")
        self._throttle_sec = options.get("throttle_duration_sec", 0.0)
        self._skip_first = options.get("skip_first", False)
        self._once = options.get("once", False)
        self._last_sec = float("-inf")
        self._skipped = False
        self._done = False

    def settings(self) -> tuple[object, ...]:
        return self.level, self._throttle_sec, self._skip_first, self._once, self.clock

    def passes(self, now_sec: float) -> bool:
        """Apply the filters in rclpy's order; earlier ones count messages that a later one stops."""
        if self._throttle_sec:
            if now_sec < self._last_sec + self._throttle_sec:
                return False
            self._last_sec = now_sec
        if self._skip_first and not self._skipped:
            self._skipped = True
            return False
        if self._once:
            first, self._done = not self._done, True
            return first
        return True


class Logger:
    """A named logger; `get_logger` returns the one of a name.

    Messages are not format strings, and are converted to text only if they are logged. All log methods raise
    TypeError for an unknown option, and ValueError if the severity or the filters of a line that has filters
    change between calls: one line has one state.

    Args:
        name: Its name, with dots between the levels; "" for the logger above all others.
        monotonic: Source of seconds for throttling.
    """

    __slots__ = ("_logger", "_monotonic", "_sites", "name")

    def __init__(self, name: str = "", *, monotonic: Callable[[], float] = time.monotonic) -> None:
        self.name = name
        self._logger = logging.getLogger(_PREFIX + name if name else ROOT_NAME)
        self._monotonic = monotonic
        self._sites: dict[tuple[CodeType, int], _Site] = {}

    @property
    def filters(self) -> int:
        """Number of lines of code whose filters are kept."""
        return len(self._sites)

    def __repr__(self) -> str:
        return f"Logger({self.name!r})"

    def get_child(self, name: str) -> Logger:
        """Return the logger `<this>.<name>`, which inherits this one's level until it has its own.

        Args:
            name: The rest of its name, not empty.

        Raises:
            ValueError: The name is empty.
        """
        if not name:
            raise ValueError("Child logger name must not be empty.")
        return get_logger(f"{self.name}.{name}" if self.name else name)

    def set_level(self, level: LoggingSeverity | int) -> None:
        """Set the least severity that is logged.

        Args:
            level: The severity; UNSET inherits the parent's level again.

        Raises:
            ValueError: There is no such severity.
        """
        self._logger.setLevel(int(LoggingSeverity(level)))

    def get_effective_level(self) -> LoggingSeverity:
        """Return the effective level, own or inherited; a level between two severities is rounded up."""
        level = self._logger.getEffectiveLevel()
        return next((severity for severity in LoggingSeverity if severity >= level), LoggingSeverity.FATAL)

    def is_enabled_for(self, severity: LoggingSeverity | int) -> bool:
        """Return whether a message would be logged.

        Args:
            severity: Its severity.

        Raises:
            ValueError: There is no such severity.
        """
        return self._logger.isEnabledFor(int(LoggingSeverity(severity)))

    def debug(self, message: object, **options: Unpack[LogOptions]) -> bool:
        """Log a message for debugging.

        Args:
            message: The message; any object.
            options: See `LogOptions`.

        Returns:
            Whether it was logged.
        """
        # The level is tested here and not in `_log`: a message below the level then costs one call, and its
        # options are looked at only if there are any.
        if self._logger.isEnabledFor(_DEBUG):
            return self._log(_DEBUG, message, options)
        return _skip(options)

    def info(self, message: object, **options: Unpack[LogOptions]) -> bool:
        """Log normal operation.

        Args:
            message: The message; any object.
            options: See `LogOptions`.

        Returns:
            Whether it was logged.
        """
        if self._logger.isEnabledFor(_INFO):
            return self._log(_INFO, message, options)
        return _skip(options)

    def warning(self, message: object, **options: Unpack[LogOptions]) -> bool:
        """Log a possible problem.

        Args:
            message: The message; any object.
            options: See `LogOptions`.

        Returns:
            Whether it was logged.
        """
        if self._logger.isEnabledFor(_WARN):
            return self._log(_WARN, message, options)
        return _skip(options)

    warn = warning

    def error(self, message: object, **options: Unpack[LogOptions]) -> bool:
        """Log an error.

        Args:
            message: The message; any object.
            options: See `LogOptions`.

        Returns:
            Whether it was logged.
        """
        if self._logger.isEnabledFor(_ERROR):
            return self._log(_ERROR, message, options)
        return _skip(options)

    def fatal(self, message: object, **options: Unpack[LogOptions]) -> bool:
        """Log an error that ends the node.

        Args:
            message: The message; any object.
            options: See `LogOptions`.

        Returns:
            Whether it was logged.
        """
        if self._logger.isEnabledFor(_FATAL):
            return self._log(_FATAL, message, options)
        return _skip(options)

    def log(self, message: object, severity: LoggingSeverity | int, **options: Unpack[LogOptions]) -> bool:
        """Log with a severity that is an argument.

        Args:
            message: The message; any object.
            severity: Its severity.
            options: See `LogOptions`.

        Returns:
            Whether it was logged.

        Raises:
            ValueError: There is no such severity, or the line has used another one with filters.
            TypeError: There is no such option.
        """
        level = int(LoggingSeverity(severity))
        if self._logger.isEnabledFor(level):
            return self._log(level, message, options)
        return _skip(options)

    def _log(self, level: int, message: object, options: LogOptions) -> bool:
        # The caller of the public method. The standard module does the same; `inspect` would read files.
        frame = sys._getframe(2)  # noqa: SLF001 # pyright: ignore[reportPrivateUsage]
        code = frame.f_code
        exception = None
        if options:
            _skip(options)
            exception = options.get("exc_info")
            # By instruction, not by line: two log calls on one line have filters of their own, as in rclpy.
            # The filters come before the record is made, because most throttled messages end here.
            if not self._filters_pass((code, frame.f_lasti), level, options):
                return False
        stamp_ns = time.time_ns()
        logger = self._logger
        info = None if exception is None else (type(exception), exception, exception.__traceback__)
        # `makeRecord` and the rest instead of `Logger.log`: that would look for the caller by itself, and
        # find this module; and it does not tell whether a filter has stopped the record.
        record = logger.makeRecord(
            logger.name, level, code.co_filename, frame.f_lineno, str(message), (), info, code.co_name
        )
        # The record's own `created` is a float, too coarse for nanoseconds.
        record.stamp_ns = stamp_ns
        passed: Any = logger.filter(record)
        if not passed:
            return False
        if isinstance(passed, logging.LogRecord):  # a filter's own, since Python 3.12
            record = passed
        # Asked for each record, since a program may add or remove handlers at any time.
        if logger.hasHandlers():
            logger.callHandlers(record)
        else:
            write_unhandled(record)
        # Last, and only what the logger's own filters let pass: `/rosout` shows what the program would have
        # printed.
        for sink in sinks_of(self.name):
            sink.accept(record)
        return True

    def _filters_pass(self, key: tuple[CodeType, int], level: int, options: LogOptions) -> bool:
        wanted = _Site(level, options)
        if not any(wanted.settings()[1:]):
            return True
        site = self._sites.setdefault(key, wanted)
        # Generated code has a new code object each time. Without a limit these would never be freed.
        if len(self._sites) > MAX_FILTERS:
            del self._sites[next(iter(self._sites))]
        # rclpy's rule. One state cannot serve two settings, and which one would win depended on the order
        # of calls.
        if site.settings() != wanted.settings():
            raise ValueError("The severity and the filters of a log call cannot be changed between calls.")
        clock = site.clock
        return site.passes(self._monotonic() if clock is None else clock.now().nanoseconds / 1e9)


def _skip(options: LogOptions) -> bool:
    """Return False for a message that is not logged; a misspelt or lonely option raises nevertheless."""
    # Checked also when the message is not logged. Otherwise a misspelt option would raise for the first
    # time when somebody turns on debug output, in production.
    if options and (unknown := options.keys() - _KNOWN_OPTIONS):
        known = ", ".join(_KNOWN_OPTIONS)
        raise TypeError(f"{min(unknown)!r} is not one of the recognized logging options: {known}")
    if "throttle_time_source_type" in options and "throttle_duration_sec" not in options:
        raise TypeError("throttle_time_source_type needs throttle_duration_sec, which is not given")
    return False


@cache
def get_logger(name: str) -> Logger:
    """Return the logger of a name, always the same object, so that filters keep their state.

    Args:
        name: With dots between the levels, not empty.

    Raises:
        ValueError: The name is empty.
    """
    if not name:
        raise ValueError("Logger name must not be empty.")
    return Logger(name)
