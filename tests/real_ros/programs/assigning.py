"""Values that programs give to the fields of messages, and whether they are what is sent."""

from __future__ import annotations

import array
import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import Imu
from std_msgs.msg import (
    Bool,
    Byte,
    ByteMultiArray,
    Char,
    Float32,
    Float32MultiArray,
    Float64,
    Float64MultiArray,
    Int8,
    Int32MultiArray,
    Int64,
    String,
    UInt8,
    UInt8MultiArray,
    UInt64,
)  # fmt: skip
from unique_identifier_msgs.msg import UUID

from tests.real_ros.programs.errors import outcome
from tests.real_ros.programs.message_types import plain

SCALARS = {
    "True": True, "0": 0, "1": 1, "-1": -1, "300": 300, "2**63": 2**63, "2**64": 2**64, "1.5": 1.5,
    "1.0": 1.0, "1e300": 1e300, "nan": math.nan, "text": "text", "empty text": "", "NUL": "a\0b",
    "bytes": b"\x01", "two bytes": b"\x01\x02", "None": None, "list": [1], "Decimal": Decimal("1.5"),
    "Fraction": Fraction(3, 2), "complex": 1j, "numpy bool": np.True_, "numpy int8": np.int8(-1),
    "numpy uint8": np.uint8(200), "numpy int64": np.int64(7), "numpy float16": np.float16(0.5),
    "numpy float32": np.float32(1.5), "numpy float64": np.float64(0.1), "numpy str": np.str_("text"),
    "numpy bytes": np.bytes_(b"\x01"), "numpy array of one": np.array([1.5]),
    "numpy array of no dimension": np.array(1.5),
}  # fmt: skip
SEQUENCES = {
    "empty list": [], "ints": [1, 2], "floats": [1.5, 2.5], "mixed": [1, 2.5], "bools": [True, False],
    "texts": ["a", "b"], "tuple": (1, 2), "set": {1}, "range": range(2), "text": "ab", "bytes": b"\x01\x02",
    "bytearray": bytearray(b"\x01\x02"), "memoryview": memoryview(b"\x01\x02"),
    "list of bytes": [b"\x01", b"\x02"], "None": None, "large": [300, 1], "negative": [-1, 1],
    "nested": [[1]], "nan": [math.nan], "dict": {1: 2}, "array B": array.array("B", [1, 2]),
    "array d": array.array("d", [1.5, 2.5]), "array f": array.array("f", [1.5, 2.5]),
    "array i": array.array("i", [1, 2]), "array l": array.array("l", [1, 2]),
    "array of large ints": array.array("l", [2**40]), "numpy float64": np.array([1.5, 2.5]),
    "numpy float32": np.array([1.5, 2.5], np.float32), "numpy int64": np.array([1, 2]),
    "numpy int32": np.array([1, 2], np.int32), "numpy uint8": np.array([1, 2], np.uint8),
    "numpy negative": np.array([-1, 1]), "numpy bool": np.array([True, False]),
    "numpy texts": np.array(["a", "b"]), "numpy matrix": np.array([[1.5, 2.5], [3.5, 4.5]]),
    "numpy strided": np.array([1.5, 0, 2.5, 0])[::2], "numpy empty": np.array([]),
    "numpy scalars": [np.float32(1.5), np.int64(2)], "numpy objects": np.array([1, 2], object),
    "numpy big-endian": np.array([1.5, 2.5], ">f8"),
}  # fmt: skip
FIXED = {
    "list": [1.5] * 9, "ints": [1] * 9, "tuple": (1.5,) * 9, "short": [1.5] * 8, "long": [1.5] * 10,
    "array d": array.array("d", [1.5] * 9), "array f": array.array("f", [1.5] * 9),
    "numpy float64": np.ones(9), "numpy float32": np.ones(9, np.float32), "numpy int64": np.ones(9, int),
    "numpy short": np.ones(8), "numpy matrix": np.ones((3, 3)), "range": range(9),
}  # fmt: skip
FIXED_BYTES = {
    "list": [1] * 16, "tuple": (1,) * 16, "bytes": bytes(range(16)), "bytearray": bytearray(16),
    "short": [1] * 15, "large": [300] * 16, "numpy uint8": np.arange(16, dtype=np.uint8),
    "numpy int64": np.arange(16), "numpy negative": np.full(16, -1), "array B": array.array("B", range(16)),
    "array i": array.array("i", range(16)),
}  # fmt: skip

FIELDS = {
    **{
        cls.__name__: (cls, "data", SCALARS)
        for cls in (Bool, Byte, Char, Float32, Float64, Int8, UInt8, Int64)
    },
    **{cls.__name__: (cls, "data", SCALARS) for cls in (UInt64, String)},
    **{
        cls.__name__: (cls, "data", SEQUENCES)
        for cls in (Float64MultiArray, Float32MultiArray, Int32MultiArray)
    },
    **{cls.__name__: (cls, "data", SEQUENCES) for cls in (UInt8MultiArray, ByteMultiArray)},
    "Imu": (Imu, "orientation_covariance", FIXED),
    "UUID": (UUID, "uuid", FIXED_BYTES),
}


def sent(name, only_defined):
    """Return what is sent for each value in a field, and whether it is that value.

    Args:
        name: A key of `FIELDS`.
        only_defined: Leave out the values with which rclpy reads memory that is not theirs.
    """
    cls, field, values = FIELDS[name]
    return {
        shown: {way.__name__: outcome(way, cls, field, value) for way in (assigned, constructed)}
        for shown, value in values.items()
        if not only_defined or _is_defined(cls, value)
    }


def _is_defined(cls, value):
    if cls is Byte:
        return isinstance(value, bytes)
    if cls in {Float32, Float64}:
        return isinstance(value, float)
    if cls is ByteMultiArray:
        return isinstance(value, list) and all(isinstance(each, bytes) for each in value)
    if cls in {Imu, UUID}:
        right = np.float64 if cls is Imu else np.uint8
        is_list = isinstance(value, list | tuple) and isinstance(value[0], float if cls is Imu else int)
        size = len(value) == (9 if cls is Imu else 16)
        return size and (
            is_list or (isinstance(value, np.ndarray) and value.dtype == right and value.ndim == 1)
        )
    return True


def assigned(cls, field, value):
    """Assign a value."""
    message = cls()
    setattr(message, field, value)
    return _sent(message, field, value)


def constructed(cls, field, value):
    """Give a value to the constructor."""
    return _sent(cls(**{field: value}), field, value)


def _sent(message, field, value):
    arrived = plain(getattr(deserialize_message(serialize_message(message), type(message)), field))
    return {"sent": arrived, "is_value": _is(arrived, value)}


def _is(arrived, value):
    if isinstance(arrived, list):
        sequences = list | tuple | set | range | bytes | bytearray | memoryview | array.array | np.ndarray
        values = [*value] if isinstance(value, sequences) else None
        return values is not None and len(arrived) == len(values) and all(map(_is, arrived, values))
    if isinstance(arrived, str) or isinstance(value, str):
        return isinstance(value, str) and arrived == value
    if isinstance(value, bytes):
        return len(value) == 1 and arrived == value[0]
    try:
        # As far as float32 has digits. NaN is itself.
        is_near = math.isclose(arrived, value, rel_tol=1e-6) or (math.isnan(arrived) and math.isnan(value))
    except (TypeError, ValueError, OverflowError):
        return False
    return arrived == value or is_near
