"""test_msgs/msg/UnboundedSequences."""

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
    UInt8Sequence,
    UInt16Array,
    UInt16Sequence,
    UInt32Array,
    UInt32Sequence,
    UInt64Array,
    UInt64Sequence,
    int32,
)


class UnboundedSequences(Message, type_name="test_msgs/msg/UnboundedSequences"):
    """test_msgs/msg/UnboundedSequences."""

    bool_values: list[bool] = msgspec.field(default_factory=list[bool])
    byte_values: ByteSequence = b""
    char_values: CharSequence = b""
    float32_values: Float32Sequence = msgspec.field(default_factory=Float32Array)
    float64_values: Float64Sequence = msgspec.field(default_factory=Float64Array)
    int8_values: Int8Sequence = msgspec.field(default_factory=Int8Array)
    uint8_values: UInt8Sequence = b""
    int16_values: Int16Sequence = msgspec.field(default_factory=Int16Array)
    uint16_values: UInt16Sequence = msgspec.field(default_factory=UInt16Array)
    int32_values: Int32Sequence = msgspec.field(default_factory=Int32Array)
    uint32_values: UInt32Sequence = msgspec.field(default_factory=UInt32Array)
    int64_values: Int64Sequence = msgspec.field(default_factory=Int64Array)
    uint64_values: UInt64Sequence = msgspec.field(default_factory=UInt64Array)
    string_values: list[str] = msgspec.field(default_factory=list[str])
    basic_types_values: list[BasicTypes] = msgspec.field(default_factory=list[BasicTypes])
    constants_values: list[Constants] = msgspec.field(default_factory=list[Constants])
    defaults_values: list[Defaults] = msgspec.field(default_factory=list[Defaults])
    bool_values_default: list[bool] = msgspec.field(default_factory=lambda: [False, True, False])
    byte_values_default: ByteSequence = b"\x00\x01\xff"
    char_values_default: CharSequence = b"\x00\x01\x7f"
    float32_values_default: Float32Sequence = msgspec.field(
        default_factory=lambda: Float32Array([1.125, 0.0, -1.125])
    )
    float64_values_default: Float64Sequence = msgspec.field(
        default_factory=lambda: Float64Array([3.1415, 0.0, -3.1415])
    )
    int8_values_default: Int8Sequence = msgspec.field(default_factory=lambda: Int8Array([0, 127, -128]))
    uint8_values_default: UInt8Sequence = b"\x00\x01\xff"
    int16_values_default: Int16Sequence = msgspec.field(
        default_factory=lambda: Int16Array([0, 32767, -32768])
    )
    uint16_values_default: UInt16Sequence = msgspec.field(default_factory=lambda: UInt16Array([0, 1, 65535]))
    int32_values_default: Int32Sequence = msgspec.field(
        default_factory=lambda: Int32Array([0, 2147483647, -2147483648])
    )
    uint32_values_default: UInt32Sequence = msgspec.field(
        default_factory=lambda: UInt32Array([0, 1, 4294967295])
    )
    int64_values_default: Int64Sequence = msgspec.field(
        default_factory=lambda: Int64Array([0, 9223372036854775807, -9223372036854775808])
    )
    uint64_values_default: UInt64Sequence = msgspec.field(
        default_factory=lambda: UInt64Array([0, 1, 18446744073709551615])
    )
    string_values_default: list[str] = msgspec.field(default_factory=lambda: ["", "max value", "min value"])
    alignment_check: int32 = 0
