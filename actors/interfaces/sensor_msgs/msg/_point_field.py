"""sensor_msgs/msg/PointField."""

from typing import ClassVar

from actors.interfaces.message import Message
from actors.interfaces.types import uint8, uint32


class PointField(Message, type_name="sensor_msgs/msg/PointField"):
    """sensor_msgs/msg/PointField."""

    INT8: ClassVar[uint8] = 1
    UINT8: ClassVar[uint8] = 2
    INT16: ClassVar[uint8] = 3
    UINT16: ClassVar[uint8] = 4
    INT32: ClassVar[uint8] = 5
    UINT32: ClassVar[uint8] = 6
    FLOAT32: ClassVar[uint8] = 7
    FLOAT64: ClassVar[uint8] = 8

    name: str = ""
    offset: uint32 = 0
    datatype: uint8 = 0
    count: uint32 = 0
