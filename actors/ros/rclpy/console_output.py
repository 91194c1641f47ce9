"""The variables that say how ROS 2 prints the log."""

from __future__ import annotations

import re
import sys
from typing import Any, Final

from actors.config.environment import InvalidEnvironmentError, foreign_variables

_ESCAPES: Final = {r"\a": "\a", r"\b": "\b", r"\n": "\n", r"\r": "\r", r"\t": "\t"}
_ESCAPE: Final = re.compile(r"\\[abnrt]")


def console_output() -> dict[str, Any]:
    """Return the options of `configure_logging` that the environment has.

    Raises:
        InvalidEnvironmentError: A variable is neither 0 nor 1.
    """
    options: dict[str, Any] = {}
    color, to_stdout = _switch("RCUTILS_COLORIZED_OUTPUT"), _switch("RCUTILS_LOGGING_USE_STDOUT")
    if color is not None:
        options["color"] = color
    if to_stdout:
        options["stream"] = sys.stdout
    pattern = foreign_variables().get("RCUTILS_CONSOLE_OUTPUT_FORMAT")
    if pattern:
        options["pattern"] = _ESCAPE.sub(lambda escape: _ESCAPES[escape[0]], pattern)
    return options


def _switch(name: str) -> bool | None:
    value = foreign_variables().get(name, "")
    if value not in {"", "0", "1"}:
        raise InvalidEnvironmentError(name, value, "0 or 1")
    return value == "1" if value else None
