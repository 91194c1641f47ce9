"""Fills messages from plain values."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from actors.interfaces import convert
from actors.tools.stamps import Stamps

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actors.interfaces.builtin_interfaces.msg import Time
    from actors.interfaces.message import Message


def set_message_fields(
    msg: Message,
    values: Mapping[str, Any],
    expand_header_auto: bool = False,
    expand_time_now: bool = False,
) -> list[Callable[[Time], None]]:
    """Set fields of a message; after an error none is set.

    Args:
        msg: The message; fields that are not in `values` keep their values.
        values: Field name to value: a dict for a nested message, a list of dicts for a sequence of messages.
        expand_header_auto: Accept "auto" for a Header, and "now" for a Time.
        expand_time_now: The same.

    Returns:
        Functions that set each such time, of the header or the field, when they are called with a Time.

    Raises:
        AttributeError: A key is not a field.
        TypeError: `values`, or the value of a nested message, is not a dict.
        ValueError: A value does not fit its field.
    """
    stamps = Stamps([])
    if expand_header_auto or expand_time_now:
        values, stamps = Stamps.taken_from(type(msg), values)
    convert.set_message_fields(msg, values)
    return [partial(_set_time, msg, Stamps([path])) for path in stamps.paths]


def _set_time(message: Message, stamps: Stamps, time: Time) -> None:
    stamps.set(message, time.sec * 1_000_000_000 + time.nanosec)
