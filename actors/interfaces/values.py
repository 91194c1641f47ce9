"""Values of sequence fields: how they compare, and how they print.

A numeric sequence may be given as a list, a tuple, an `array.array`, a NumPy array or any other sequence. Two
are equal if they are equal as arrays of the field's element type.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, Final, cast

from actors.interfaces.arrays import ARRAY_BY_ELEMENT, NumericArray, pack
from actors.interfaces.fields import BINARY, fields_of, nested_classes

if TYPE_CHECKING:
    from actors.interfaces.fields import FieldType
    from actors.interfaces.naming import MessageType

_MAX_BYTES: Final = 256
"""Only the length of a longer binary sequence is shown."""
_BYTES: Final = (bytes, bytearray, memoryview)
_FLOATS: Final = frozenset({"float32", "float64"})
_NUMPY_DEFAULTS: Final = frozenset({"int64", "float64"})
"""Element types that NumPy does not name when it prints an array."""


def bytes_of(values: Any) -> bytes:
    """Return a list of integers, or of bytes objects of length 1, as bytes.

    Raises:
        TypeError: An element is neither.
        ValueError: An integer is not between 0 and 255.
    """
    return bytes(ord(each) if isinstance(each, bytes) else each for each in values)


@cache
def sequences_of(cls: MessageType) -> dict[str, FieldType]:
    """Return the fields of a message class that are sequences, of anything but messages, and their types."""
    try:
        fields = fields_of(cls)
    except TypeError:
        return {}
    return {field.name: field.type for field in fields if field.type.is_array and field.type.message is None}


@cache
def has_sequences(cls: MessageType) -> bool:
    """Return whether a message of class `cls` contains such a sequence, at any depth."""
    try:
        return any(map(sequences_of, nested_classes(cls)))
    except TypeError:
        return False


def _held(field_type: FieldType, value: Any) -> Any:
    """Return a sequence as a received message would hold it.

    Raises:
        TypeError: `value` does not fit the field; so do ValueError and OverflowError.
    """
    array = ARRAY_BY_ELEMENT.get(field_type.base)
    if array is not None:
        return value if type(value) is array else array(value)
    if field_type.base in BINARY:
        packed = pack(value)
        return packed if isinstance(packed, memoryview) else bytes_of(value)
    return value.tolist() if hasattr(value, "dtype") else list(value)


def same(field_type: FieldType, left: Any, right: Any) -> bool:
    """Return whether two values of a sequence field are equal; as in ROS 2, NaN is equal to nothing."""
    # A sequence with a NaN is not equal to itself, and only floats can be NaN.
    if left is right and field_type.base not in _FLOATS:
        return True
    try:
        return bool(_held(field_type, left) == _held(field_type, right))
    except (TypeError, ValueError, OverflowError):
        # At least one is no value of this field, and may be of any type.
        return repr(left) == repr(right)


def value_repr(field_type: FieldType | None, value: Any) -> str:
    """Return a field's value as ROS 2 prints it: `array([0., 0.])` for a fixed array of numbers, else a list.

    Args:
        field_type: The field's type; None if it is no sequence.
        value: Its value, which need not fit.
    """
    base = field_type.base if field_type is not None else ""
    if base in ARRAY_BY_ELEMENT or base in {"uint8", "char"}:
        assert field_type is not None
        try:
            held = _held(field_type, value)
        except (TypeError, ValueError, OverflowError):
            return repr(value)
        # ROS 2's classes hold a NumPy array in such a field, and print it as one.
        if field_type.is_fixed:
            return _fixed(held, "uint8" if base == "char" else base)
        if isinstance(held, NumericArray):
            return repr(held.tolist())
        value = held
    if isinstance(value, _BYTES):
        plain = bytes(cast("bytes", value))
        return f"<{len(plain)} bytes>" if len(plain) > _MAX_BYTES else repr(plain)
    return repr(value)


def _fixed(held: Any, element: str) -> str:
    """Return a fixed array as NumPy prints it, which is only imported for this; without NumPy in one line."""
    numbers: list[Any] = held.tolist() if hasattr(held, "tolist") else list(held)
    try:
        import numpy as np  # noqa: PLC0415 - an extra, and slow to import
    except ImportError:
        return f"array({numbers}{'' if element in _NUMPY_DEFAULTS else f', dtype={element}'})"
    return repr(np.array(numbers, dtype=element))
