"""Message types as rosapi describes them. Pure.

A definition has names of ROS 1, such as "std_msgs/Header". `fieldarraylen` is -1 for a single value, 0 for a
sequence and the length of a fixed array.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast

from actors.interfaces.fields import constants_of, fields_of
from actors.interfaces.message import type_name

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.interfaces.fields import FieldType
    from actors.interfaces.message import Message

MAX_TYPES: Final = 500
"""Types in one answer, as in a definition of a bag."""

_SINGLE: Final = -1


def type_definitions(msg_type: type[Message]) -> list[dict[str, Any]]:
    """Return the definition of a message type, and those of all that it contains.

    Args:
        msg_type: The message class.
    """
    found: dict[type[Message], dict[str, Any]] = {}
    _add(msg_type, found)
    return [*found.values()]


def _add(msg_type: type[Message], found: dict[type[Message], dict[str, Any]]) -> None:
    if msg_type in found or len(found) >= MAX_TYPES:
        return
    fields, constants = fields_of(msg_type), constants_of(msg_type)
    found[msg_type] = {
        "type": _short(type_name(msg_type)),
        "fieldnames": [each.name for each in fields],
        "fieldtypes": [_base(each.type) for each in fields],
        "fieldarraylen": [_length(each.type) for each in fields],
        "examples": [_example(each.type) for each in fields],
        "constnames": [name for name, _, _ in constants],
        "constvalues": [_constant(value) for _, _, value in constants],
    }
    for each in _nested(msg_type):
        _add(each, found)


def _nested(msg_type: type[Message]) -> Iterator[type[Message]]:
    for each in fields_of(msg_type):
        if each.type.message is not None:
            yield cast("type[Message]", each.type.message)


def _base(kind: FieldType) -> str:
    return _short(kind.base) if kind.message is not None else kind.base


def _length(kind: FieldType) -> int:
    if not kind.is_array:
        return _SINGLE
    return kind.low if kind.is_fixed else 0


def _example(kind: FieldType) -> str:
    if kind.is_array:
        return "[]"
    if kind.message is not None:
        return "{}"
    if kind.base in {"string", "wstring"}:
        return ""
    return {"bool": "False", "float32": "0.0", "float64": "0.0"}.get(kind.base, "0")


def _constant(value: object) -> str:
    return str(value[0] if isinstance(value, bytes) else value)


def _short(name: str) -> str:
    package, _, rest = name.partition("/")
    return f"{package}/{rest.rpartition('/')[2]}"
