"""Error texts for messages that do not fit their type: the field, the expected value, the actual one."""

from __future__ import annotations

import re
import reprlib
from typing import TYPE_CHECKING, Any, Final, cast

import msgspec

from actors.interfaces.arrays import element_of
from actors.interfaces.fields import BINARY, fields_of
from actors.interfaces.literals import INTEGER_RANGE
from actors.interfaces.naming import message_name
from actors.interfaces.values import bytes_of, sequences_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.interfaces.fields import FieldType
    from actors.interfaces.message import Message

_AT: Final = re.compile(r" - at `\$?([^`]*)`$")
_STEP: Final = re.compile(r"\.(\w+)|\[(\d+)\]")


def _split(error: BaseException) -> tuple[str, str]:
    """Return the path ("" or ".a[0].b") and the reason that msgspec's error text holds."""
    text = str(error)
    at = _AT.search(text)
    path = at[1] if at else ""
    reason = (text[: at.start()] if at else text).replace("`", "")
    return path, reason or type(error).__name__


def explain_decoding(cls: type[Message], error: BaseException) -> str:
    """Return why bytes are not a message of type `cls`."""
    path, reason = _split(error)
    return f"{message_name(cls)}{path}: {reason}"


def _value_at(message: Message, path: str) -> object:
    value: Any = message
    for name, index in _STEP.findall(path):
        value = getattr(value, name) if name else value[int(index)]
    return value


def _wrong_class(message: Message, path: str) -> str:
    """Return where on a path a nested message has a wrong class, and both classes; "" if none has."""
    value: Any = message
    at, kind = "", None
    for step in _STEP.finditer(path):
        name, index = step.groups()
        if name:
            kind = {field.name: field.type for field in fields_of(cast("Any", type(value)))}[name]
        value = getattr(value, name) if name else value[int(index)]
        at += step[0]
        expected: Any = kind and kind.message
        if kind is None or expected is None or (name and kind.is_array) or isinstance(value, expected):
            continue
        got = message_name(type(value)) if isinstance(value, msgspec.Struct) else type(value).__name__
        return f"{at}: Expected {message_name(expected)}, got {got}"
    return ""


def _sequence_type(message: Message, path: str) -> FieldType | None:
    """Return the type of the field at the end of `path`, if it is a sequence of anything but messages."""
    owner_path, _, name = path.rpartition(".")
    return sequences_of(cast("Any", type(_value_at(message, owner_path)))).get(name)


def _sequence_reason(kind: FieldType, value: Any) -> str:
    """Return why a sequence's value does not fit, in ROS's terms; "" if msgspec's text says it well."""
    if kind.base in BINARY and isinstance(value, list | tuple):
        try:
            value = bytes_of(cast("Any", value))
        except (TypeError, ValueError) as error:
            return f"Expected {kind}: {error}"
    try:
        view: memoryview[Any] = memoryview(value)
    except TypeError:
        return ""
    element = element_of(view)
    if kind.base in BINARY and element == "uint8":
        return f"Expected {kind}, got {len(view)} elements"
    return f"Expected {kind}, got {element}[]" if element else ""


def _unencodable(message: Message, encode: Callable[[Any], bytes]) -> tuple[str, Any, Any]:
    """Return the path to the innermost value that cannot be encoded, the value, and its message."""
    path = ""
    value: Any = message
    owner: Any = None
    while True:
        children: list[tuple[str, Any]] = []
        if isinstance(value, msgspec.Struct):
            owner = value
            children = [(f".{name}", getattr(owner, name, None)) for name in owner.__struct_fields__]
        elif type(value) is list:
            children = [(f"[{index}]", item) for index, item in enumerate(cast("Any", value))]
        for step, child in children:
            try:
                # msgspec does not say where encoding failed. Trying each part finds it; this is slow, and
                # only done for an error.
                encode(child)
            except Exception:  # noqa: BLE001 - any error identifies the value
                path, value = path + step, child
                break
        else:
            return path, cast("Any", value), owner


def _expected(owner: Any, path: str, value: object, error: BaseException) -> str:
    """Return the expected type of the field at the end of `path`, whose `value` cannot be encoded."""
    name = path.rpartition(".")[2].partition("[")[0]
    kind = {field.name: field.type for field in fields_of(cast("Any", type(owner)))}.get(name)
    if not isinstance(value, int) or isinstance(value, bool):
        reason = _split(error)[1]
        return reason if path.endswith("]") else reason.replace("a field value", str(kind))
    base = kind.base if kind else ""
    if base not in INTEGER_RANGE:
        return f"Expected {base}"
    low, high = INTEGER_RANGE[base]
    return f"Expected int <= {high}" if value > high else f"Expected int >= {low}"


def explain_encoding(message: Message, error: BaseException, encode: Callable[[Any], bytes]) -> str:
    """Return which field of `message` does not fit, why, and its value."""
    name = message_name(type(message))
    if isinstance(error, RecursionError):
        return f"{name}: the message contains itself, or is nested too deeply"
    if isinstance(error, msgspec.ValidationError):
        path, reason = _split(error)
        try:
            if wrong := _wrong_class(message, path):
                return f"{name}{wrong}"
            value = _value_at(message, path)
            kind = _sequence_type(message, path)
        except (AttributeError, IndexError, KeyError, TypeError):
            return f"{name}{path}: {reason}"
        if kind is not None and (kind.base in BINARY or reason.endswith(", got ext")):
            # The decoder has seen an extension, and its text would speak of "ext", which no user has
            # written.
            reason = _sequence_reason(kind, value) or reason
        if ", got " in reason:
            return f"{name}{path}: {reason}"
    else:
        path, value, owner = _unencodable(message, encode)
        reason = _expected(owner, path, value, error)
        if ", got " in reason:
            return f"{name}{path}: {reason}"
    # Python refuses to print integers of thousands of digits.
    shown = repr(value) if isinstance(value, int) and abs(value) < 2**256 else reprlib.repr(value)
    return f"{name}{path}: {reason}, got {shown}"
