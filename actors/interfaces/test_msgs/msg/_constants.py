"""test_msgs/msg/Constants."""

from typing import ClassVar

from actors.interfaces.message import Message
from actors.interfaces.types import (
    byte,
    char,
    float32,
    float64,
    int8,
    int16,
    int32,
    int64,
    uint8,
    uint16,
    uint32,
    uint64,
)


class Constants(Message, type_name="test_msgs/msg/Constants"):
    """test_msgs/msg/Constants."""

    BOOL_CONST: ClassVar[bool] = True
    BYTE_CONST: ClassVar[byte] = b"2"
    CHAR_CONST: ClassVar[char] = 100
    FLOAT32_CONST: ClassVar[float32] = 1.125
    FLOAT64_CONST: ClassVar[float64] = 1.125
    INT8_CONST: ClassVar[int8] = -50
    UINT8_CONST: ClassVar[uint8] = 200
    INT16_CONST: ClassVar[int16] = -1000
    UINT16_CONST: ClassVar[uint16] = 2000
    INT32_CONST: ClassVar[int32] = -30000
    UINT32_CONST: ClassVar[uint32] = 60000
    INT64_CONST: ClassVar[int64] = -40000000
    UINT64_CONST: ClassVar[uint64] = 50000000
