"""rcl_interfaces/msg/ParameterValue."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.types import (
    ByteSequence,
    Float64Array,
    Float64Sequence,
    Int64Array,
    Int64Sequence,
    float64,
    int64,
    uint8,
)


class ParameterValue(Message, type_name="rcl_interfaces/msg/ParameterValue"):
    """rcl_interfaces/msg/ParameterValue."""

    type: uint8 = 0
    bool_value: bool = False
    integer_value: int64 = 0
    double_value: float64 = 0.0
    string_value: str = ""
    byte_array_value: ByteSequence = b""
    bool_array_value: list[bool] = msgspec.field(default_factory=list[bool])
    integer_array_value: Int64Sequence = msgspec.field(default_factory=Int64Array)
    double_array_value: Float64Sequence = msgspec.field(default_factory=Float64Array)
    string_array_value: list[str] = msgspec.field(default_factory=list[str])
