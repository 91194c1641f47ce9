"""Values as JSON from which JavaScript reads them without loss."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, cast

from actors.interfaces.convert import message_to_ordereddict

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.interfaces.message import Message

MAX_EXACT: Final = 2**53
"""The greatest integer up to which JavaScript's numbers are exact."""


def message_to_javascript(message: Message | Mapping[str, Any], truncate_length: int | None = None) -> Any:
    """Return a message as maps, lists, texts and numbers.

    Integers beyond 2^53, NaN and infinities become texts, which is how a page shows them.

    Args:
        message: A message, or the dict of a message of unknown type.
        truncate_length: Longer texts and sequences are cut; None: never.

    Raises:
        InvalidMessageError: It is nested too deeply.
    """
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
