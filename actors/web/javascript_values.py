"""Values as JSON from which JavaScript reads them without loss."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, cast

from actors.interfaces.convert import message_to_ordereddict
from actors.interfaces.message import Message
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Mapping

MAX_EXACT: Final = 2**53
"""The greatest integer up to which JavaScript's numbers are exact."""


MAX_VALUES: Final = 1_000_000
"""Numbers, texts and nested messages of a message: it takes a second, and 100 MB, to make JSON of so many."""


class TooManyValuesError(CallboardError):
    """A message has more than `MAX_VALUES` values. Show it with a command such as `callboard topic echo`."""


def message_to_javascript(message: Message | Mapping[str, Any], truncate_length: int | None = None) -> Any:
    """Return a message as maps, lists, texts and numbers.

    Integers beyond 2^53, NaN and infinities become texts, which is how a page shows them.

    Args:
        message: A message, or the dict of a message of unknown type.
        truncate_length: Longer texts and sequences are cut; None: never.

    Raises:
        InvalidMessageError: It is nested too deeply.
        TooManyValuesError: It has more than `MAX_VALUES`.
    """
    _require_few(message, truncate_length or MAX_VALUES)
    return to_javascript(message_to_ordereddict(message, truncate_length=truncate_length))


def to_javascript(value: Any) -> Any:
    """Return maps, lists, texts and numbers with texts in place of what JavaScript's numbers cannot hold.

    Args:
        value: A value that JSON can express, or NaN or an infinity.
    """
    if isinstance(value, dict):
        return {key: to_javascript(each) for key, each in cast("dict[str, Any]", value).items()}
    if isinstance(value, list):
        items: list[Any] = value  # pyright: ignore[reportUnknownVariableType]
        return [to_javascript(each) for each in items]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if isinstance(value, int) and not -MAX_EXACT <= value <= MAX_EXACT:
        return str(value)
    return value


def _require_few(message: Message | Mapping[str, Any], shown: int) -> None:
    """Raise TooManyValuesError if a message has too many values.

    Args:
        message: The message.
        shown: Items that are shown of each sequence.
    """
    waiting: list[Any] = [message]
    left = MAX_VALUES
    while waiting and len(waiting) <= left:
        value = waiting.pop()
        if isinstance(value, Message):
            waiting += [getattr(value, name) for name in value.__struct_fields__]
        elif isinstance(value, dict):
            waiting += cast("dict[str, Any]", value).values()
        elif isinstance(value, list):
            waiting += value[:shown]
        else:
            is_array = not isinstance(value, str) and hasattr(value, "__len__")
            left -= min(len(value), shown) if is_array else 1
    if left < len(waiting):
        raise TooManyValuesError(f"The message has more than {MAX_VALUES} values, which no page shows")
