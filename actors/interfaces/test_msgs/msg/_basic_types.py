"""test_msgs/msg/BasicTypes."""

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


class BasicTypes(Message, type_name="test_msgs/msg/BasicTypes"):
    """test_msgs/msg/BasicTypes."""

    bool_value: bool = False
    byte_value: byte = b"\x00"
    char_value: char = 0
    float32_value: float32 = 0.0
    float64_value: float64 = 0.0
    int8_value: int8 = 0
    uint8_value: uint8 = 0
    int16_value: int16 = 0
    uint16_value: uint16 = 0
    int32_value: int32 = 0
    uint32_value: uint32 = 0
    int64_value: int64 = 0
    uint64_value: uint64 = 0
