"""Messages with random values: the limits of each type, and what lies between them."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

from actors.interfaces.arrays import ARRAY_BY_ELEMENT
from actors.interfaces.fields import BINARY, fields_of
from actors.interfaces.literals import INTEGER_RANGE
from actors.interfaces.message import Action, Message, Service

if TYPE_CHECKING:
    from collections.abc import Iterator
    from random import Random

    from actors.interfaces.fields import FieldType

T = TypeVar("T", bound=Message)

MAX_ELEMENTS: Final = 3
MAX_DEPTH: Final = 4
"""Levels at which sequences have elements: a type may contain itself."""
_TEXTS: Final = ("", "a", "base_link", "é", "日本", "\U0001f600", "tab\tand\nline", "x" * 40)
_FLOATS: Final = (0.0, -0.0, 1.5, -3.25, float("inf"), float("-inf"), 2.0**-149, 2.0**127)
"""Numbers that float32 has, too."""


def random_message(cls: type[T], random: Random, depth: int = 0) -> T:
    """Return a message with random values.

    Args:
        cls: Its class.
        random: Where they come from.
        depth: In how many sequences it is.
    """
    values = {field.name: _value(field.type, random, depth) for field in fields_of(cast("Any", cls))}
    return cls(**values)


def _value(kind: FieldType, random: Random, depth: int) -> Any:
    if not kind.is_array:
        return _element(kind, random, depth)
    most = MAX_ELEMENTS if kind.high is None else kind.high
    count = kind.low if kind.is_fixed else random.randint(kind.low, min(most, kind.low + MAX_ELEMENTS))
    if depth > MAX_DEPTH and not kind.is_fixed:
        count = kind.low
    if kind.base in BINARY:
        return bytes(random.randrange(256) for _ in range(count))
    items = [_element(kind, random, depth + 1) for _ in range(count)]
    return ARRAY_BY_ELEMENT[kind.base](items) if kind.base in ARRAY_BY_ELEMENT else items


def _element(kind: FieldType, random: Random, depth: int) -> Any:
    if kind.message is not None:
        return random_message(cast("Any", kind.message), random, depth)
    if kind.base == "bool":
        return random.random() < 0.5
    if kind.base == "byte":
        return bytes([random.randrange(256)])
    if kind.base in INTEGER_RANGE:
        low, high = INTEGER_RANGE[kind.base]
        return random.choice((low, high, 0, random.randint(low, high)))
    if kind.base in {"float32", "float64"}:
        value = random.choice((*_FLOATS, random.uniform(-1e9, 1e9)))
        return struct.unpack("f", struct.pack("f", value))[0] if kind.base == "float32" else value
    text = random.choice(_TEXTS)
    return text[: kind.string_bound] if kind.string_bound else text


def values_of(message: Message) -> dict[str, Any]:
    """Return the values of a message as the real side's `plain` does: bytes are numbers."""
    found: dict[str, Any] = {}
    for field in fields_of(cast("Any", type(message))):
        value = getattr(message, field.name)
        if field.type.message is not None:
            found[field.name] = (
                [values_of(each) for each in value] if field.type.is_array else values_of(value)
            )
        elif field.type.base == "byte" and not field.type.is_array:
            found[field.name] = value[0]
        else:
            found[field.name] = list(value) if field.type.is_array else value
    return found


def message_classes(cls: type[Any]) -> Iterator[type[Message]]:
    """Return the message classes of an interface: itself, or its parts and what carries them."""
    if issubclass(cls, Message):
        yield cls
    elif issubclass(cls, Service):
        service = cast("Any", cls)
        yield from (service.Request, service.Response, service.Event)
    elif issubclass(cls, Action):
        action = cast("Any", cls)
        yield from (action.Goal, action.Result, action.Feedback, action.Impl.FeedbackMessage)
        yield from message_classes(action.Impl.SendGoalService)
        yield from message_classes(action.Impl.GetResultService)
