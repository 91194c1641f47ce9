"""Errors that say where in a description they are.

Planning knows the action and its file, but not what is wrong with them. So errors are raised without a
location, and get one here, once: `has_location` says that this has happened.
"""

from __future__ import annotations

import traceback
from typing import TYPE_CHECKING, Any

from actors.errors import error_text
from actors.launch.description.actions import DeclareLaunchArgument
from actors.launch.description.summaries import action_label, function_name
from actors.launch.errors import LaunchError, LaunchFileError
from proto.errors import CallboardError, InvalidNameError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.launch.description.action import Action


def with_location(error: BaseException, action: Action, file: str | None) -> LaunchError:
    """Return an error of an action in one line that says where it is.

    Args:
        error: The error.
        action: The action; if it comes from a document, it knows its line.
        file: The launch file; None: the description comes from no file.
    """
    if action.describe_location is not None:
        where = [action.describe_location()]
    else:
        # Errors about launch arguments name the argument already.
        summary = None if isinstance(action, DeclareLaunchArgument) else action_label(action)
        where = [each for each in (file, summary) if each]
    kind = LaunchFileError if isinstance(error, LaunchFileError) else LaunchError
    return _located(kind(": ".join([*where, _text(error)])))


def function_error(function: Callable[..., Any], error: BaseException, file: str | None) -> LaunchError:
    """Return an exception of a function of the description in one line that says where it was raised.

    Args:
        function: The function.
        error: The exception.
        file: The launch file; None: the description comes from no file.
    """
    if isinstance(error, LaunchError) and error.has_location:
        return error
    code = getattr(function, "__code__", None)
    # A line of the launch file says more than one of a library that the function calls.
    path = file if file is not None and line_in(file, error) else getattr(code, "co_filename", None)
    line = None if path is None else line_in(path, error)
    if line is None and code is not None:  # the call failed, such as with a wrong number of arguments
        path, line = code.co_filename, code.co_firstlineno
    where = f"{path}, line {line}: " if line else ""
    return _located(LaunchError(f"{where}{function_name(function)}: {_text(error)}"))


def result_error(function: Callable[..., Any], text: str) -> LaunchError:
    """Return an error about the result of a function of the description."""
    code = getattr(function, "__code__", None)
    where = "" if code is None else f"{code.co_filename}, line {code.co_firstlineno}: "
    return _located(LaunchError(f"{where}{function_name(function)} {text}"))


def line_in(path: str, error: BaseException) -> int | None:
    """Return the last line of a file in the traceback of an exception, or the line of its syntax error."""
    line = error.lineno if isinstance(error, SyntaxError) and error.filename == path else None
    for frame, number in traceback.walk_tb(error.__traceback__):
        if frame.f_code.co_filename == path:
            line = number
    return line


def _located(error: LaunchError) -> LaunchError:
    error.has_location = True
    return error


def _text(error: BaseException) -> str:
    if isinstance(error, InvalidNameError):  # its own text has three lines
        return f"'{escape(error.name)}' cannot be a {error.kind}: {error.reason}"
    kind = "" if isinstance(error, CallboardError) else f"{type(error).__name__}: "
    return " ".join(f"{kind}{error_text(error)}".split("\n"))
