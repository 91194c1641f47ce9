"""Values of parameters from JSON, in which a number may stand for several types. Pure: no I/O."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast

from actors.parameters.types import Parameter, ParameterType
from actors.tools.node_documents import PARAMETER_TYPES
from proto.errors import CallboardError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Callable


class InvalidValueError(CallboardError):
    """A value that the parameter's type does not have; the text names the parameter."""


def parameter_from_json(name: str, kind: ParameterType | None, value: object) -> Parameter:
    """Return a parameter with a value from JSON.

    Args:
        name: The parameter's name.
        kind: Its type; None: that which the value has in JSON, a number with a fraction being a double.
        value: The value; None for none. Integers, and doubles such as "nan", may be texts, as JSON's numbers
            cannot express all of them; bytes are a list of numbers.

    Raises:
        InvalidValueError: The type does not have the value.
    """
    try:
        if not kind or value is None:
            return Parameter(name, value=cast("Any", value))
        return Parameter(name, kind, _READERS[kind](value))
    except (TypeError, ValueError, OverflowError):
        what = f"of type {PARAMETER_TYPES[kind]}" if kind else "that a parameter can have"
        raise InvalidValueError(f"'{escape(name)}': this is not a value {what}") from None


def kind_from_name(name: str) -> ParameterType:
    """Return the type of a name such as "integer array".

    Raises:
        InvalidValueError: There is no such type.
    """
    try:
        return ParameterType(PARAMETER_TYPES.index(name))
    except ValueError:
        known = ", ".join(PARAMETER_TYPES[1:])
        raise InvalidValueError(f"There is no type '{escape(name)}'; there are {known}") from None


def _integer(value: Any) -> int:
    return int(value, 10) if isinstance(value, str) else value


def _double(value: Any) -> float:
    if isinstance(value, bool):
        raise TypeError
    return float(value)


def _same(value: Any) -> Any:
    return value


def _list_of(read: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def read_list(value: Any) -> list[Any]:
        return [read(each) for each in _items(value)]

    return read_list


def _bytes(value: Any) -> bytes:
    return bytes(_items(value))


def _items(value: Any) -> list[Any]:
    if isinstance(value, list):
        return value  # pyright: ignore[reportUnknownVariableType]
    raise TypeError


_READERS: Final[dict[ParameterType, Callable[[Any], Any]]] = {
    ParameterType.BOOL: _same,
    ParameterType.INTEGER: _integer,
    ParameterType.DOUBLE: _double,
    ParameterType.STRING: _same,
    ParameterType.BYTE_ARRAY: _bytes,
    ParameterType.BOOL_ARRAY: _same,
    ParameterType.INTEGER_ARRAY: _list_of(_integer),
    ParameterType.DOUBLE_ARRAY: _list_of(_double),
    ParameterType.STRING_ARRAY: _same,
}
"""The types themselves are checked by `Parameter`."""
