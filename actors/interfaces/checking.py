"""Checks of fields where they are assigned, to find the line that assigns a wrong value.

They are off unless a program switches them on, because a message is checked again when it is published. Then
they hold for all messages that the process makes and changes, with the types and the error texts of ROS 2's
classes: a float field takes no integer.
"""

from __future__ import annotations

import math
from collections import UserString
from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any, Final, cast

from actors.interfaces.arrays import element_of
from actors.interfaces.fields import BINARY, fields_of
from actors.interfaces.literals import INTEGER_RANGE
from actors.interfaces.message import Message
from actors.interfaces.naming import MessageType

if TYPE_CHECKING:
    from actors.interfaces.fields import FieldType

_MAX_FLOAT32: Final = 3.402823466e38
_PYTHON: Final[dict[str, type]] = {
    "bool": bool, "byte": bytes, "float32": float, "float64": float, "string": str, "wstring": str
}  # fmt: skip


def check_assignments(*, enabled: bool = True) -> None:
    """Let all messages of this process check what is assigned to their fields, and given to their classes.

    A wrong value raises AssertionError, as does a field that does not exist.

    Args:
        enabled: Whether to check from now on.
    """
    methods = ((Message, "__setattr__", _checked_setattr), (MessageType, "__call__", _checked_call))
    # On the base classes, so that all message classes are affected, also those that do not exist yet; and
    # nothing is left in the way of an assignment while the checks are off.
    for cls, name, method in methods:
        if enabled:
            setattr(cls, name, method)
        elif name in cls.__dict__:
            delattr(cls, name)


def _checked_setattr(message: Message, name: str, value: object) -> None:
    check_field(type(message), name, value)
    super(Message, message).__setattr__(name, value)


def _checked_call(cls: MessageType, *args: object, **fields: object) -> Any:
    fields.pop("check_fields", None)  # ROS 2's switch for one message
    check_fields(cls, args, fields)
    return super(MessageType, cls).__call__(*args, **fields)


def check_fields(cls: MessageType, args: tuple[object, ...], fields: dict[str, object]) -> None:
    """Raise AssertionError unless the class can be called with these values, by position and by name."""
    unknown = sorted(fields.keys() - set(cls.__struct_fields__))
    assert not unknown, f"Invalid arguments passed to constructor: {', '.join(unknown)}"
    for name, value in [*zip(cls.__struct_fields__, args, strict=False), *fields.items()]:
        check_field(cls, name, value)


def check_field(cls: MessageType, name: str, value: object) -> None:
    """Raise AssertionError unless a field of messages of a class accepts a value."""
    kind = _types(cls).get(name)
    if kind is not None and not _fits(kind, value):
        raise AssertionError(f"The '{name}' field must be {_expected(kind, value)}")


@cache
def _types(cls: MessageType) -> dict[str, FieldType]:
    return {field.name: field.type for field in fields_of(cls)}


def _fits(kind: FieldType, value: Any) -> bool:
    if kind.is_array:
        return _sequence_fits(kind, value)
    given: object = value
    if not isinstance(given, kind.message or _PYTHON.get(kind.base, int)):
        return False
    if kind.base == "byte":
        return len(value) == 1
    if kind.base in INTEGER_RANGE:
        low, high = INTEGER_RANGE[kind.base]
        return bool(low <= value <= high)
    if kind.base == "float32":
        return not abs(value) > _MAX_FLOAT32 or math.isinf(value)
    return not kind.string_bound or len(value) <= kind.string_bound


def _sequence_fits(kind: FieldType, value: Any) -> bool:
    try:
        # A buffer first: an image is checked by its type and length, not byte by byte.
        with memoryview(value) as view:
            element = "uint8" if kind.base in BINARY else kind.base
            return view.ndim == 1 and element_of(view) == element and _length_fits(kind, len(view))
    except TypeError:
        pass  # not a buffer
    # ROS 2's classes refuse a str here, too, although it is a sequence of str.
    if isinstance(value, str | UserString) or not isinstance(value, Sequence | AbstractSet):
        return False
    items = cast("Sequence[Any]", value)
    return _length_fits(kind, len(items)) and all(_fits(_element(kind), each) for each in items)


def _length_fits(kind: FieldType, length: int) -> bool:
    return kind.low <= length and (kind.high is None or length <= kind.high)


@cache
def _element(kind: FieldType) -> FieldType:
    return replace(kind, is_array=False, low=0, high=None)


def _expected(kind: FieldType, value: object) -> str:
    """Return the values that a field accepts, in ROS 2's words."""
    python = kind.message.__name__ if kind.message is not None else _PYTHON.get(kind.base, int).__name__
    limits = _limits(kind)
    if kind.is_array:
        length = "" if kind.high is None else f" with length {'' if kind.is_fixed else '<= '}{kind.high}"
        text = f" and each string value not longer than {kind.string_bound}" if kind.string_bound else ""
        text = f"a set or sequence{length}{text} and each value of type '{python}'"
        return f"{text} and each {limits}" if limits else text
    if kind.message is not None:
        return f"a sub message of type '{python}'"
    if kind.string_bound:
        return f"string value not longer than {kind.string_bound}"
    if kind.base == "byte":
        return "of type 'bytes' with length 1"
    if limits and isinstance(value, _PYTHON.get(kind.base, int)):
        return f"a{'n' if limits[0] in 'iu' else ''} {limits}"
    return f"of type '{python}'"


def _limits(kind: FieldType) -> str:
    if kind.base == "float32":
        return f"float in [-{_MAX_FLOAT32}, {_MAX_FLOAT32}]"
    if kind.base not in INTEGER_RANGE or kind.base == "byte":
        return ""
    low, high = INTEGER_RANGE[kind.base]
    return f"{'integer' if low else 'unsigned integer'} in [{low}, {high}]"
