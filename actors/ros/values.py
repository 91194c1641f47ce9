"""Values of messages as programs for ROS 2 expect them.

callboard's messages have bytes for `uint8[]`, which are not copied, and need no NumPy. ROS 2's have an
`array.array` that can be changed, a list for `byte[]`, and NumPy arrays for fixed arrays of numbers. Messages
that such a program receives are converted after they have been decoded; the classes are the same.

ROS 2's messages also convert a list that is assigned to a field of numbers. The classes do that once the
program has made an entity (a publisher, client, service or action) that uses them.

Classes that `message_classes.py` has changed do all of this themselves, and are left alone here.
"""

from __future__ import annotations

from array import array
from contextlib import suppress
from functools import cache, partial
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

from actors.interfaces.arrays import ARRAY_BY_ELEMENT
from actors.interfaces.codec import codec_for
from actors.interfaces.fields import fields_of, nested_classes
from actors.interfaces.message import is_message_type
from actors.ros.message_classes import has_adopted, numpy_module

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.interfaces.fields import FieldType
    from actors.interfaces.naming import MessageType

T = TypeVar("T")
_BYTES: Final = (memoryview, bytes)
"""What a decoded message has for `uint8[]`, `char[]` and `byte[]`; nothing else is converted again."""


def rosidl_values(message: T) -> T:
    """Convert the values of a received message in place. Callbacks that share it find it converted.

    Args:
        message: The message, or anything else, which is left alone.

    Returns:
        The same message.
    """
    for name, convert in _conversions(cast("Any", type(message))):
        setattr(message, name, convert(getattr(message, name)))
    return message


def prepare(*classes: Any) -> None:
    """Load what converting messages of these classes needs, such as NumPy, before the first one arrives."""
    for each in classes:
        _conversions(each)
        if is_message_type(each) and any(
            field.type.is_fixed and _is_numeric(field.type)
            for nested in nested_classes(each)
            for field in fields_of(nested)
        ):
            numpy_module()


def _is_numeric(kind: FieldType) -> bool:
    return kind.base in ARRAY_BY_ELEMENT or kind.base in {"uint8", "char"}


def copied(message: T) -> T:
    """Return a copy of a message that is to be sent later: the program may change the message before that.

    Raises:
        InvalidMessageError: A field has a wrong type or is out of range.
    """
    codec: Any = codec_for(cast("Any", type(message)))
    copy: T = codec.decode(codec.encode(message))
    return copy


@cache
def convert_assignments(cls: MessageType) -> None:
    """Let messages of a class, and those in them, convert lists that are assigned to fields of numbers.

    A list that does not fit is left as it is: sending the message says what is wrong with it. Arrays of
    another element type are converted when the message is sent, also those given to the constructor.

    Args:
        cls: The message class. Classes without sequences of numbers are not changed, and lose no time.
    """
    codec_for(cast("Any", cls)).converts = True
    for each in nested_classes(cls):
        types = {
            field.name: made for field in fields_of(each) if (made := _for_assignment(field.type)) is not None
        }
        if (
            types and not has_adopted(each) and "__setattr__" not in each.__dict__
        ):  # not yet, for a class that contains it
            base: Any = each
            type.__setattr__(each, "__setattr__", _converting_setattr(base.__setattr__, types))


def _converting_setattr(
    assign: Callable[[Any, str, Any], None], types: dict[str, Callable[[Any], Any]]
) -> Callable[[Any, str, object], None]:
    def set_value(message: Any, name: str, value: object) -> None:
        if isinstance(value, list | tuple) and name in types:
            with suppress(TypeError, ValueError, OverflowError):
                value = types[name](value)
        assign(message, name, value)

    return set_value


def _for_assignment(kind: FieldType) -> Callable[[Any], Any] | None:
    """Return what makes a sequence of numbers from a list; None for other types."""
    made = ARRAY_BY_ELEMENT.get(kind.base)
    element = "uint8" if kind.base == "char" else kind.base
    if not kind.is_array or (made is None and element != "uint8"):
        return None
    numpy: Any = numpy_module() if kind.is_fixed else None
    if numpy is not None:
        return partial(numpy.array, dtype=element)
    return made or partial(array, "B")


@cache
def _has_conversions(cls: MessageType) -> bool:
    return is_message_type(cls) and any(
        _for_received(field.type)
        for each in nested_classes(cls)
        if not has_adopted(each)
        for field in fields_of(each)
    )


@cache
def _conversions(cls: Any) -> tuple[tuple[str, Callable[[Any], Any]], ...]:
    """Return the fields of a class that are converted, and how; none if it is no message class."""
    if not _has_conversions(cls):
        return ()
    found: list[tuple[str, Callable[[Any], Any]]] = []
    for field in fields_of(cls):
        nested = field.type.message
        convert = None if has_adopted(cls) else _for_received(field.type)
        if nested is not None and _has_conversions(nested):
            convert = _convert_each if field.type.is_array else rosidl_values
        if convert is not None:
            found.append((field.name, convert))
    return tuple(found)


def _convert_each(messages: list[Any]) -> list[Any]:
    return [rosidl_values(message) for message in messages]


def _for_received(kind: FieldType) -> Callable[[Any], Any] | None:
    """Return what converts a sequence of a type; None if it has the right values, or is no sequence."""
    if not kind.is_array or kind.message is not None:
        return None
    if kind.base == "byte":
        return _bytes_list
    binary = kind.base in {"uint8", "char"}
    numpy: Any = numpy_module() if kind.is_fixed and (binary or kind.base in ARRAY_BY_ELEMENT) else None
    if numpy is not None:
        return partial(_numpy_array, numpy, numpy.dtype("uint8" if binary else kind.base))
    return _byte_array if binary else None


def _byte_array(value: Any) -> Any:
    if not isinstance(value, _BYTES):
        return value
    made = array("B")
    made.frombytes(cast("bytes", value))
    return made


def _bytes_list(value: Any) -> Any:
    return [bytes([each]) for each in cast("bytes", value)] if isinstance(value, _BYTES) else value


def _numpy_array(numpy: Any, dtype: Any, value: Any) -> Any:
    if isinstance(value, numpy.ndarray):
        return value
    # Bytes are copied, because they are read-only; arrays share their memory.
    made = numpy.frombuffer(value, dtype)
    return made.copy() if isinstance(value, _BYTES) else made
