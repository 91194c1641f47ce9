"""test_msgs/msg/Defaults."""

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


class Defaults(Message, type_name="test_msgs/msg/Defaults"):
    """test_msgs/msg/Defaults."""

    bool_value: bool = True
    byte_value: byte = b"2"
    char_value: char = 100
    float32_value: float32 = 1.125
    float64_value: float64 = 1.125
    int8_value: int8 = -50
    uint8_value: uint8 = 200
    int16_value: int16 = -1000
    uint16_value: uint16 = 2000
    int32_value: int32 = -30000
    uint32_value: uint32 = 60000
    int64_value: int64 = -40000000
    uint64_value: uint64 = 50000000
