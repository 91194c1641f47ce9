"""Describes the fields of a message for a form, as JSON. Pure.

    {"type": "example_interfaces/srv/AddTwoInts_Request",
     "types": {"example_interfaces/srv/AddTwoInts_Request": [
         {"name": "a", "type": "int64", "kind": "integer", "minimum": …, "maximum": …, "default": 0}, …]}}

`kind` is "boolean", "integer", "number", "text" or "message"; the latter's fields are in `types` under
`message`, so that types that contain each other end. A sequence has `array` with `low` and `high` (null: no
limit). `choices` are constants that may be meant for the field; `required` fields have no default. `comment`
is what the definition says about the field.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, cast

import msgspec

from actors.interfaces.comments import comments_of
from actors.interfaces.fields import BINARY, constants_of, fields_of, nested_classes
from actors.interfaces.literals import INTEGER_RANGE
from actors.interfaces.message import type_name
from proto.errors import CallboardError

if TYPE_CHECKING:
    from actors.interfaces.fields import Field, FieldType
    from actors.interfaces.message import Message

MAX_DEFAULTS: Final = 10_000
"""Values of all defaults of a form, which a page shows in a field each."""

_TEXTS: Final = frozenset({"string", "wstring"})
_NUMBERS: Final = frozenset({"float32", "float64"})


class FormTooLargeError(CallboardError):
    """A type has more values than a form has fields. Use a command such as `callboard topic pub`."""


def form_of(cls: type[Message]) -> dict[str, Any]:
    """Return the description of a form for messages of a class.

    Args:
        cls: The message class; for a service its request, for an action its goal.

    Raises:
        FormTooLargeError: Its defaults have more than `MAX_DEFAULTS` values.
    """
    types, defaults = sorted(nested_classes(cls), key=type_name), _Defaults()
    return {
        "type": type_name(cls),
        "types": {type_name(each): _fields(cast("Any", each), defaults) for each in types},
    }


def _fields(cls: type[Message], defaults: _Defaults) -> list[dict[str, Any]]:
    fields = fields_of(cls)
    choices = _choices(cls, fields)
    comments = comments_of(cls).fields
    described: list[dict[str, Any]] = []
    for field in fields:
        found = {"name": field.name, "type": str(field.type), **_kind(field.type)}
        if field.name in choices:
            found["choices"] = choices[field.name]
        if _has_default(cls, field):
            if (default := defaults.of(cls, field)) is not None:
                found["default"] = default
        else:
            found["required"] = True
        if field.name in comments:
            found["comment"] = comments[field.name]
        described.append(found)
    return described


def _kind(kind: FieldType) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if kind.message is not None:
        found = {"kind": "message", "message": kind.base}
    elif kind.base in INTEGER_RANGE:
        low, high = INTEGER_RANGE[kind.base]
        found = {"kind": "integer", "minimum": low, "maximum": high}
    elif kind.base in _NUMBERS:
        found = {"kind": "number"}
    elif kind.base in _TEXTS:
        found = {"kind": "text", **({"max_length": kind.string_bound} if kind.string_bound else {})}
    else:
        found = {"kind": "boolean"}
    if kind.is_array:
        found["array"] = {"low": kind.low, "high": kind.high}
    return found


def _choices(cls: type[Message], fields: tuple[Field, ...]) -> dict[str, list[dict[str, Any]]]:
    """Return the constants for each field of their type: those that begin with its name, or all the others.

    ROS does not say to which field a constant belongs.
    """
    found: dict[str, list[dict[str, Any]]] = {}
    left = {name: (kind.base, _plain(kind.base, value)) for name, kind, value in constants_of(cls)}
    scalars = [field for field in fields if not field.type.is_array and field.type.message is None]
    for field in scalars:
        own = [
            name
            for name, (base, _) in left.items()
            if base == field.type.base and name.startswith(f"{field.name.upper()}_")
        ]
        if own:
            found[field.name] = [{"name": name, "value": left.pop(name)[1]} for name in own]
    for field in scalars:
        others = [
            {"name": name, "value": value} for name, (base, value) in left.items() if base == field.type.base
        ]
        if others and field.name not in found:
            found[field.name] = others
    return found


def _position(cls: type[Message], field: Field) -> int:
    """Return a field's position from the end, where defaults are counted from."""
    return cls.__struct_fields__.index(field.name) - len(cls.__struct_fields__)


def _has_default(cls: type[Message], field: Field) -> bool:
    number, defaults = _position(cls, field), cls.__struct_defaults__
    return -number <= len(defaults) and defaults[number] is not msgspec.NODEFAULT


class _Defaults:
    """Makes JSON of the defaults of a form, and counts their values."""

    def __init__(self) -> None:
        self._left = MAX_DEFAULTS

    def of(self, cls: type[Message], field: Field) -> Any:
        """Return a field's default as JSON; None if it is as the field's type alone says."""
        defaults: tuple[Any, ...] = cls.__struct_defaults__
        number = _position(cls, field)
        factory = getattr(defaults[number], "factory", None)
        value = defaults[number] if factory is None else factory()
        nested: Any = field.type.message
        if nested is not None and not field.type.is_array and (factory is nested or value == nested()):
            return None
        return self._json(field.type, value) if not field.type.is_array or len(value) else None

    def _json(self, kind: FieldType, value: Any) -> Any:
        """Return a field's value as JSON."""
        if kind.is_array:
            self._count(len(value))
            one = replace(kind, is_array=False)
            return [self._json(one, each) for each in value]
        if kind.message is None:
            return _plain(kind.base, value)
        fields = fields_of(kind.message)
        self._count(len(fields))
        return {each.name: self._json(each.type, getattr(value, each.name)) for each in fields}

    def _count(self, values: int) -> None:
        self._left -= values
        if self._left < 0:
            text = f"The type's defaults have more than {MAX_DEFAULTS} values, which are too many for a form"
            raise FormTooLargeError(text)


def _plain(base: str, value: Any) -> Any:
    """Return a primitive value as JSON has it: a byte is a number, and what is no number is a string."""
    if base in BINARY and isinstance(value, bytes):
        return value[0]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value
