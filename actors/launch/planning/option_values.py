"""The values that the options of an action have in a context, checked against their rows in the table."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING, Any, Final

from actors.launch.description.conditions import to_bool
from actors.launch.description.options import options_of
from actors.launch.description.substitutions import resolve
from actors.launch.errors import LaunchError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.launch.description.action import Action
    from actors.launch.description.options import Option
    from actors.launch.description.substitutions import LaunchContext


def option_value(action: Action, name: str, context: LaunchContext) -> Any:
    """Return the value of an option: a string, truth value or number, or None if that is its default.

    Args:
        action: The action.
        name: The option.
        context: Where it is evaluated.

    Raises:
        LaunchError: A substitution has no value there, or the value is out of range.
    """
    # None stands for the default of the launch, such as its stop timeout, and not for a value.
    option = next(each for each in options_of(type(action)) if each.name == name)
    value: object = getattr(action, name)
    return None if value is None else _READERS[option.type](option, value, context)


def option_values(action: Action, cls: type[Action], context: LaunchContext) -> dict[str, Any]:
    """Return the values of the options of a base class that are strings, truth values or numbers.

    The names of durations end in `_sec`, as everywhere but in launch files, where they are ROS 2's.

    Args:
        action: The action.
        cls: The class whose options are meant.
        context: Where they are evaluated.

    Raises:
        LaunchError: A substitution has no value there, or a value is out of range.
    """
    return {
        f"{each.name}_sec" if each.unit else each.name: option_value(action, each.name, context)
        for each in options_of(cls)
        if each.type in _READERS
    }


def _text(option: Option, value: Any, context: LaunchContext) -> str:
    word = resolve(value, context)
    if option.choices and word not in option.choices:
        raise LaunchError(f"{option.name} must be one of {', '.join(option.choices)}, not '{escape(word)}'")
    return word


def _flag(_option: Option, value: Any, context: LaunchContext) -> bool:
    return to_bool(value, context)


def _number(option: Option, value: Any, context: LaunchContext) -> float:
    text = str(value) if isinstance(value, int | float) else resolve(value, context)
    try:
        number = float(text)
    except ValueError:
        number = math.nan  # as "nan" itself: no comparison below holds for it
    whole = option.type.startswith("int")
    # An infinite respawn delay or stop timeout would be a process that is never started, or never ends.
    most = math.inf if option.unlimited else sys.float_info.max
    if not option.least <= number <= most or (whole and number % 1):
        what = "a whole number" if whole else "a number of seconds" if option.unit else "a number"
        raise LaunchError(f"{option.name} must be {what}, {option.least:g} or more, not '{escape(text)}'")
    return int(number) if whole else number


_READERS: Final[dict[str, Callable[[Option, Any, LaunchContext], Any]]] = {
    "Text": _text,
    "Text | None": _text,
    "bool | Text": _flag,
    "int | Text": _number,
    "int | Text | None": _number,
    "float | Text": _number,
    "float | Text | None": _number,
}
"""Functions that evaluate an option, by its annotation."""
