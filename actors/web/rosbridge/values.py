"""Messages from and to the values of rosbridge. Pure.

In JSON, NaN and infinities are null, `uint8[]`, `uint8[N]` and `char[]` are base64, and other sequences are
lists. What clients send may also have lists of numbers for these, null for a float, the names `secs` and
`nsecs` of ROS 1 in times and durations, and no header, or one without a stamp: it gets the time then.
"""

from __future__ import annotations

import binascii
import math
from functools import cache
from typing import TYPE_CHECKING, Any, Final, cast

import msgspec

from actors.interfaces.arrays import ARRAY_BY_ELEMENT, NumericArray
from actors.interfaces.fields import BINARY, fields_of
from actors.interfaces.message import Message, type_name
from actors.web.json_encoding import encode_json
from actors.web.rosbridge.operations import OperationError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actors.interfaces.fields import FieldType
    from actors.web.rosbridge.operations import Arguments

SMALL_BYTES: Final = 16 * 1024
"""A message up to this size is converted at once: it takes less time than to give it to a thread."""

TIME: Final = "builtin_interfaces/msg/Time"
DURATION: Final = "builtin_interfaces/msg/Duration"
HEADER: Final = "std_msgs/msg/Header"

_FLOATS: Final = frozenset({"float32", "float64"})
_ROS_1_NAMES: Final = {"secs": "sec", "nsecs": "nanosec"}


def json_of(message: Message | Mapping[str, Any], size: int) -> bytes:
    """Return a message as JSON.

    Args:
        message: A message, or the dict of a message of unknown type.
        size: Its bytes as received: of a large one the encoder makes a piece at a time.

    Raises:
        TypeError: A message of unknown type has a value that no message has.
    """
    if size > SMALL_BYTES or not isinstance(message, Message) or _has_octets(type(message)):
        return encode_json(plain(message, NumericArray.tolist, _base64))
    return msgspec.json.encode(message, enc_hook=_listed)


def plain(value: Any, numbers: Callable[[NumericArray], Any], binary: Callable[[bytes], Any]) -> Any:
    """Return a message as maps, lists, numbers, texts and what two functions make of sequences.

    Args:
        value: A message, or a value of one.
        numbers: Converts a sequence of numbers.
        binary: Converts `uint8[]` and `char[]`.
    """
    if isinstance(value, Message):
        converted: dict[str, Any] = {}
        for each in fields_of(type(value)):
            item = getattr(value, each.name)
            base = each.type.base
            if base == "byte":  # an integer, whose sequences are lists
                item = list(item) if each.type.is_array else item[0]
            elif base in ARRAY_BY_ELEMENT and isinstance(item, list):  # of a class with `list[float]`
                item = _array(base, item)
            converted[each.name] = plain(item, numbers, binary)
        return converted
    if isinstance(value, dict):
        return {name: plain(item, numbers, binary) for name, item in cast("dict[str, Any]", value).items()}
    if isinstance(value, list):
        items: list[Any] = value  # pyright: ignore[reportUnknownVariableType]
        return [plain(item, numbers, binary) for item in items] if _is_nested(items) else items
    if isinstance(value, NumericArray):
        return numbers(value)
    if isinstance(value, bytes | bytearray | memoryview):
        return binary(bytes(cast("bytes", value)))
    return value


def values_from_json(msg_type: type[Message], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a message's fields as `calls.message_of` takes them.

    Args:
        msg_type: The message's class.
        values: As a client has sent them. What fits no field is left as it is, for `message_of` to refuse.

    Raises:
        OperationError: A base64 text is none.
    """
    converted: dict[str, Any] = _fields(msg_type, values, type_name(msg_type))
    for each in fields_of(msg_type):
        if each.name == "header" and each.type.base == HEADER and not each.type.is_array:
            converted.setdefault("header", "auto")
    return converted


def arguments_by_name(msg_type: type[Message], args: Arguments) -> dict[str, Any]:
    """Return the arguments of a request or goal by the names of its fields.

    Args:
        msg_type: The class of the request or goal.
        args: By name, or in the order of the fields; None for none.

    Raises:
        OperationError: There are more than fields.
    """
    if isinstance(args, dict):
        return args
    names = [each.name for each in fields_of(msg_type)]
    if len(args or ()) > len(names):
        raise OperationError(
            f"{type_name(msg_type)} has {len(names)} fields, and there are {len(args or ())} values"
        )
    return dict(zip(names, args or (), strict=False))


def _array(base: str, items: Any) -> NumericArray:
    return ARRAY_BY_ELEMENT[base](items)


def _is_nested(items: list[Any]) -> bool:
    """Return whether a list has more than texts and booleans: the elements of a sequence have one type."""
    return bool(items) and not isinstance(items[0], str | bool)


def _base64(data: bytes) -> str:
    return binascii.b2a_base64(data, newline=False).decode()


def _listed(value: Any) -> list[Any]:
    if isinstance(value, NumericArray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is not a value of a message")


@cache
def _has_octets(msg_type: type[Message]) -> bool:
    """Return whether a message has a `byte`, or messages that have one: msgspec would make base64 of it."""
    seen, waiting = {msg_type}, [msg_type]
    while waiting:
        for each in fields_of(waiting.pop()):
            nested = cast("type[Message] | None", each.type.message)
            if each.type.base == "byte":
                return True
            if nested is not None and nested not in seen:
                seen.add(nested)
                waiting.append(nested)
    return False


def _fields(msg_type: type[Message], values: Any, path: str) -> Any:
    if not isinstance(values, dict):
        return values
    name = type_name(msg_type)
    given: dict[str, Any] = cast("dict[str, Any]", values)
    if name in {TIME, DURATION}:
        return {_ROS_1_NAMES.get(key, key): value for key, value in given.items()}
    types = _types_of(msg_type)
    converted = {
        key: _field(types[key], value, f"{path}.{key}") if key in types else value
        for key, value in given.items()
    }
    if name == HEADER:
        converted.pop("seq", None)  # of ROS 1
        converted.setdefault("stamp", "now")
    return converted


@cache
def _types_of(msg_type: type[Message]) -> dict[str, FieldType]:
    return {each.name: each.type for each in fields_of(msg_type)}


def _field(kind: FieldType, value: Any, path: str) -> Any:
    nested = cast("type[Message] | None", kind.message)
    if nested is not None:
        if kind.is_array and isinstance(value, list):
            items: list[Any] = value  # pyright: ignore[reportUnknownVariableType]
            return [_fields(nested, item, f"{path}[{index}]") for index, item in enumerate(items)]
        return value if kind.is_array else _fields(nested, value, path)
    if kind.is_array and kind.base in BINARY and isinstance(value, str):
        try:
            return binascii.a2b_base64(value, strict_mode=True)
        except (binascii.Error, UnicodeError, ValueError):
            raise OperationError(f"{path}: Expected base64, or a list of numbers") from None
    if kind.base in _FLOATS:
        if kind.is_array and isinstance(value, list):
            numbers: list[Any] = value  # pyright: ignore[reportUnknownVariableType]
            return [math.nan if item is None else item for item in numbers]
        if value is None and not kind.is_array:
            return math.nan
    return value
