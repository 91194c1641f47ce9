"""test_msgs/msg/Arrays."""

from typing import Annotated

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.test_msgs.msg._basic_types import BasicTypes
from actors.interfaces.test_msgs.msg._constants import Constants
from actors.interfaces.test_msgs.msg._defaults import Defaults
from actors.interfaces.types import (
    ByteSequence,
    CharSequence,
    Float32Array,
    Float32Sequence,
    Float64Array,
    Float64Sequence,
    Int8Array,
    Int8Sequence,
    Int16Array,
    Int16Sequence,
    Int32Array,
    Int32Sequence,
    Int64Array,
    Int64Sequence,
    Length,
    UInt8Sequence,
    UInt16Array,
    UInt16Sequence,
    UInt32Array,
    UInt32Sequence,
    UInt64Array,
    UInt64Sequence,
    int32,
)


class Arrays(Message, type_name="test_msgs/msg/Arrays"):
    """test_msgs/msg/Arrays."""

    bool_values: Annotated[list[bool], Length(3)] = msgspec.field(default_factory=lambda: [False] * 3)
    byte_values: Annotated[ByteSequence, Length(3)] = bytes(3)
    char_values: Annotated[CharSequence, Length(3)] = bytes(3)
    float32_values: Annotated[Float32Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: Float32Array([0.0] * 3)
    )
    float64_values: Annotated[Float64Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 3)
    )
    int8_values: Annotated[Int8Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: Int8Array([0] * 3)
    )
    uint8_values: Annotated[UInt8Sequence, Length(3)] = bytes(3)
    int16_values: Annotated[Int16Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: Int16Array([0] * 3)
    )
    uint16_values: Annotated[UInt16Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: UInt16Array([0] * 3)
    )
    int32_values: Annotated[Int32Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: Int32Array([0] * 3)
    )
    uint32_values: Annotated[UInt32Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: UInt32Array([0] * 3)
    )
    int64_values: Annotated[Int64Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: Int64Array([0] * 3)
    )
    uint64_values: Annotated[UInt64Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: UInt64Array([0] * 3)
    )
    string_values: Annotated[list[str], Length(3)] = msgspec.field(default_factory=lambda: [""] * 3)
    basic_types_values: Annotated[list[BasicTypes], Length(3)] = msgspec.field(
        default_factory=lambda: [BasicTypes() for _ in range(3)]
    )
    constants_values: Annotated[list[Constants], Length(3)] = msgspec.field(
        default_factory=lambda: [Constants() for _ in range(3)]
    )
    defaults_values: Annotated[list[Defaults], Length(3)] = msgspec.field(
        default_factory=lambda: [Defaults() for _ in range(3)]
    )
    bool_values_default: Annotated[list[bool], Length(3)] = msgspec.field(
        default_factory=lambda: [False, True, False]
    )
    byte_values_default: Annotated[ByteSequence, Length(3)] = b"\x00\x01\xff"
    char_values_default: Annotated[CharSequence, Length(3)] = b"\x00\x01\x7f"
    float32_values_default: Annotated[Float32Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: Float32Array([1.125, 0.0, -1.125])
    )
    float64_values_default: Annotated[Float64Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: Float64Array([3.1415, 0.0, -3.1415])
    )
    int8_values_default: Annotated[Int8Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: Int8Array([0, 127, -128])
    )
    uint8_values_default: Annotated[UInt8Sequence, Length(3)] = b"\x00\x01\xff"
    int16_values_default: Annotated[Int16Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: Int16Array([0, 32767, -32768])
    )
    uint16_values_default: Annotated[UInt16Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: UInt16Array([0, 1, 65535])
    )
    int32_values_default: Annotated[Int32Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: Int32Array([0, 2147483647, -2147483648])
    )
    uint32_values_default: Annotated[UInt32Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: UInt32Array([0, 1, 4294967295])
    )
    int64_values_default: Annotated[Int64Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: Int64Array([0, 9223372036854775807, -9223372036854775808])
    )
    uint64_values_default: Annotated[UInt64Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: UInt64Array([0, 1, 18446744073709551615])
    )
    string_values_default: Annotated[list[str], Length(3)] = msgspec.field(
        default_factory=lambda: ["", "max value", "min value"]
    )
    alignment_check: int32 = 0
