"""The log of all nodes, line by line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.web.javascript_values import to_javascript

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.web.live.panel import Body
    from actors.web.log_reader import LogFilter, LogReaders


class LogPanel:
    """The lines that a page wants: at first those that are kept.

    Args:
        logs: Read the log.
        chosen: Which lines.
        wake: Called when there are lines.

    Raises:
        TooManyLogReadersError: See `LogReaders.read`.
    """

    def __init__(self, logs: LogReaders, chosen: LogFilter, wake: Callable[[], None]) -> None:
        self._reader = logs.read(chosen, wake)

    def pop(self) -> Body | None:
        """Return `lines`, as `callboard log --json` prints them, and how many were `skipped`."""
        reader = self._reader
        lines = reader.pop()
        if not lines:
            return None
        skipped, reader.skipped = reader.skipped, 0
        return lambda: {"lines": to_javascript(lines), "skipped": skipped}

    def close(self) -> None:
        """Read no more."""
        self._reader.close()
