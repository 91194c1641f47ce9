"""Field types for message classes: ROS's primitive names, as aliases that type checkers understand.

    class Scan(actors.Message):
        frame: str = ""                                                    # string
        count: types.uint16 = 0                                            # range checked on both sides
        label: Annotated[str, types.AtMost(10)] = ""                       # string<=10
        image: types.UInt8Sequence = b""                                   # uint8[]
        scan: types.Float32Sequence = field(default_factory=types.Float32Array)
        axis: Annotated[types.Float64Sequence, types.Length(3)] = …        # float64[3]

Plain `int`, `float`, `str`, `bool` and `bytes` mean int64, float64, string, bool and uint8[]; `list[…]` of a
scalar type or of a message class is a sequence. Where no type fits (a dict, an optional field) there is no
ROS type, and the first use of the class says so.

What a type checker sees: integers as `int`, `float32`/`float64` as `float`, a numeric sequence as
`MutableSequence[int]` or `[float]` (assign a list, an array, or a `Float64Array(numpy_array)`), and
`uint8[]`, `byte[]`, `char[]` as `bytes | bytearray | memoryview`. At run time a received numeric sequence is
one of the `…Array` classes and a received `uint8[]` is a `memoryview` into the received bytes, not a copy.

`byte` is a `bytes` object of length 1 and `char` an `int` from 0 to 255, as in rclpy. `float32` values are
not rounded to single precision on the way, so 0.1 stays 0.1; NaN and infinities travel.
"""

# ruff: noqa: PYI042, TC003 - the aliases have ROS's names; annotations are read at run time

from __future__ import annotations

from collections.abc import MutableSequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, TypeAlias

import msgspec

from actors.interfaces.arrays import (
    Float32Array,
    Float64Array,
    Int8Array,
    Int16Array,
    Int32Array,
    Int64Array,
    UInt16Array,
    UInt32Array,
    UInt64Array,
)

__all__ = [
    "AtMost",
    "ByteSequence",
    "CharSequence",
    "Float32Array",
    "Float32Sequence",
    "Float64Array",
    "Float64Sequence",
    "Int8Array",
    "Int8Sequence",
    "Int16Array",
    "Int16Sequence",
    "Int32Array",
    "Int32Sequence",
    "Int64Array",
    "Int64Sequence",
    "Length",
    "Ros",
    "UInt8Sequence",
    "UInt16Array",
    "UInt16Sequence",
    "UInt32Array",
    "UInt32Sequence",
    "UInt64Array",
    "UInt64Sequence",
    "boolean",
    "byte",
    "char",
    "float32",
    "float64",
    "int8",
    "int16",
    "int32",
    "int64",
    "string",
    "uint8",
    "uint16",
    "uint32",
    "uint64",
    "wstring",
]


@dataclass(frozen=True)
class Ros:
    """Marks an alias with its ROS name ("int64", or "uint8[]" for a sequence)."""

    name: str


@dataclass(frozen=True)
class Length:
    """A sequence has exactly this many elements: `T[n]`."""

    count: int


@dataclass(frozen=True)
class AtMost:
    """A sequence or string has at most this many elements or characters: `T[<=n]`, `string<=n`."""

    count: int


boolean: TypeAlias = Annotated[bool, Ros("bool")]
int8: TypeAlias = Annotated[int, msgspec.Meta(ge=-(2**7), le=2**7 - 1), Ros("int8")]
int16: TypeAlias = Annotated[int, msgspec.Meta(ge=-(2**15), le=2**15 - 1), Ros("int16")]
int32: TypeAlias = Annotated[int, msgspec.Meta(ge=-(2**31), le=2**31 - 1), Ros("int32")]
int64: TypeAlias = Annotated[int, msgspec.Meta(ge=-(2**63), le=2**63 - 1), Ros("int64")]
uint8: TypeAlias = Annotated[int, msgspec.Meta(ge=0, le=2**8 - 1), Ros("uint8")]
uint16: TypeAlias = Annotated[int, msgspec.Meta(ge=0, le=2**16 - 1), Ros("uint16")]
uint32: TypeAlias = Annotated[int, msgspec.Meta(ge=0, le=2**32 - 1), Ros("uint32")]
# msgpack itself has no larger integer, and msgspec's `le` must fit int64.
uint64: TypeAlias = Annotated[int, msgspec.Meta(ge=0), Ros("uint64")]
float32: TypeAlias = Annotated[float, Ros("float32")]
float64: TypeAlias = Annotated[float, Ros("float64")]
byte: TypeAlias = Annotated[bytes, msgspec.Meta(min_length=1, max_length=1), Ros("byte")]
char: TypeAlias = Annotated[int, msgspec.Meta(ge=0, le=2**8 - 1), Ros("char")]
string: TypeAlias = Annotated[str, Ros("string")]
wstring: TypeAlias = Annotated[str, Ros("wstring")]

# Type checkers see what may be assigned; at run time `fields.py` needs to know what the decoder makes.
if TYPE_CHECKING:
    Int8Sequence: TypeAlias = MutableSequence[int]
    Int16Sequence: TypeAlias = MutableSequence[int]
    Int32Sequence: TypeAlias = MutableSequence[int]
    Int64Sequence: TypeAlias = MutableSequence[int]
    UInt16Sequence: TypeAlias = MutableSequence[int]
    UInt32Sequence: TypeAlias = MutableSequence[int]
    UInt64Sequence: TypeAlias = MutableSequence[int]
    Float32Sequence: TypeAlias = MutableSequence[float]
    Float64Sequence: TypeAlias = MutableSequence[float]
    UInt8Sequence: TypeAlias = bytes | bytearray | memoryview
    ByteSequence: TypeAlias = bytes | bytearray | memoryview
    CharSequence: TypeAlias = bytes | bytearray | memoryview
else:
    Int8Sequence = Int8Array
    Int16Sequence = Int16Array
    Int32Sequence = Int32Array
    Int64Sequence = Int64Array
    UInt16Sequence = UInt16Array
    UInt32Sequence = UInt32Array
    UInt64Sequence = UInt64Array
    Float32Sequence = Float32Array
    Float64Sequence = Float64Array
    UInt8Sequence = Annotated[memoryview, Ros("uint8[]")]
    ByteSequence = Annotated[memoryview, Ros("byte[]")]
    CharSequence = Annotated[memoryview, Ros("char[]")]
