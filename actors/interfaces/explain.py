"""Error texts for messages that do not fit their type: the field, the expected value, the actual one."""

from __future__ import annotations

import re
import reprlib
from typing import TYPE_CHECKING, Any, Final, cast

import msgspec

from actors.interfaces.fields import fields_of
from actors.interfaces.literals import INTEGER_RANGE
from actors.interfaces.naming import message_name

if TYPE_CHECKING:
    from collections.abc import Callable

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


def _unencodable(message: Message, encode: Callable[[Any], bytes]) -> tuple[str, Any, Any]:
    """Return the path to the innermost value that cannot be encoded, the value, and its message."""
    path = ""
    value: Any = message
    owner: Any = None
    while True:
        children: list[tuple[str, Any]] = []
        if hasattr(value, "__struct_fields__"):
            owner = value
            children = [(f".{name}", getattr(owner, name, None)) for name in owner.__struct_fields__]
        elif type(value) is list:
            children = [(f"[{index}]", item) for index, item in enumerate(cast("Any", value))]
        for step, child in children:
            try:
                encode(child)
            except Exception:  # noqa: BLE001 - any error identifies the value
                path, value = path + step, child
                break
        else:
            return path, cast("Any", value), owner


def _expected(owner: Any, path: str, value: object, error: BaseException) -> str:
    """Return the expected type of the field at the end of `path`, whose `value` cannot be encoded."""
    if not isinstance(value, int) or isinstance(value, bool):
        return _split(error)[1]
    name = path.rpartition(".")[2].partition("[")[0]
    base = {field.name: field.type.base for field in fields_of(cast("Any", type(owner)))}.get(name, "")
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
        if ", got " in reason:
            return f"{name}{path}: {reason}"
        try:
            value = _value_at(message, path)
        except (AttributeError, IndexError, KeyError, TypeError):
            return f"{name}{path}: {reason}"
    else:
        path, value, owner = _unencodable(message, encode)
        reason = _expected(owner, path, value, error)
        if ", got " in reason:
            return f"{name}{path}: {reason}"
    shown = repr(value) if isinstance(value, int) and abs(value) < 2**256 else reprlib.repr(value)
    return f"{name}{path}: {reason}, got {shown}"
