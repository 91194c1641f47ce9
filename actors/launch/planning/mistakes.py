"""Mistakes: where in a description something is wrong."""

from __future__ import annotations

import traceback
from typing import TYPE_CHECKING, Any

from actors.errors import error_text
from actors.launch.description.actions import DeclareLaunchArgument
from actors.launch.description.summaries import function_name, in_short
from actors.launch.errors import LaunchError, LaunchFileError
from proto.errors import CallboardError, InvalidNameError, escape

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.launch.description.action import Action


def placed(error: BaseException, action: Action, file: str | None) -> LaunchError:
    """Return what is wrong with an action, in one line that says where.

    Args:
        error: What is wrong.
        action: With which action; its document, if it comes from one, knows the line.
        file: The launch file; None: the description comes from none.
    """
    if action.place is not None:
        where = [action.place()]
    else:
        # What is wrong with an argument names it.
        summary = None if isinstance(action, DeclareLaunchArgument) else in_short(action)
        where = [each for each in (file, summary) if each]
    kind = LaunchFileError if isinstance(error, LaunchFileError) else LaunchError
    return _with_place(kind(": ".join([*where, _text(error)])))


def of_function(function: Callable[..., Any], error: BaseException, file: str | None) -> LaunchError:
    """Return what went wrong in a function of a description, in one line that says where.

    Args:
        function: The function.
        error: What it has raised.
        file: The launch file; None: the description comes from none.
    """
    if isinstance(error, LaunchError) and error.placed:
        return error
    code = getattr(function, "__code__", None)
    path = file if file is not None and line_in(file, error) else getattr(code, "co_filename", None)
    line = None if path is None else line_in(path, error)
    if line is None and code is not None:  # calling it failed
        path, line = code.co_filename, code.co_firstlineno
    where = f"{path}, line {line}: " if line else ""
    return _with_place(LaunchError(f"{where}{function_name(function)}: {_text(error)}"))


def of_result(function: Callable[..., Any], text: str) -> LaunchError:
    """Return what is wrong with what a function of a description has returned."""
    code = getattr(function, "__code__", None)
    where = "" if code is None else f"{code.co_filename}, line {code.co_firstlineno}: "
    return _with_place(LaunchError(f"{where}{function_name(function)} {text}"))


def line_in(path: str, error: BaseException) -> int | None:
    """Return the last line of a file that an exception came through, or where Python cannot read it."""
    line = error.lineno if isinstance(error, SyntaxError) and error.filename == path else None
    for frame, number in traceback.walk_tb(error.__traceback__):
        if frame.f_code.co_filename == path:
            line = number
    return line


def _with_place(error: LaunchError) -> LaunchError:
    error.placed = True
    return error


def _text(error: BaseException) -> str:
    if isinstance(error, InvalidNameError):  # its own text has three lines
        return f"'{escape(error.name)}' cannot be a {error.kind}: {error.reason}"
    kind = "" if isinstance(error, CallboardError) else f"{type(error).__name__}: "
    return " ".join(f"{kind}{error_text(error)}".split("\n"))
