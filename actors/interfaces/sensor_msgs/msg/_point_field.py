"""sensor_msgs/msg/PointField."""

from typing import ClassVar

from actors.interfaces.message import Message
from actors.interfaces.types import uint8, uint32


class PointField(Message, type_name="sensor_msgs/msg/PointField"):
    """Name, place and type of one value of a point in a PointCloud2."""

    INT8: ClassVar[uint8] = 1
    """Signed integer of 1 byte."""
    UINT8: ClassVar[uint8] = 2
    """Unsigned integer of 1 byte."""
    INT16: ClassVar[uint8] = 3
    """Signed integer of 2 bytes."""
    UINT16: ClassVar[uint8] = 4
    """Unsigned integer of 2 bytes."""
    INT32: ClassVar[uint8] = 5
    """Signed integer of 4 bytes."""
    UINT32: ClassVar[uint8] = 6
    """Unsigned integer of 4 bytes."""
    FLOAT32: ClassVar[uint8] = 7
    """Floating point number of 4 bytes."""
    FLOAT64: ClassVar[uint8] = 8
    """Floating point number of 8 bytes."""

    name: str = ""
    """What the value is, such as x, intensity or rgb."""
    offset: uint32 = 0
    """Bytes from the start of a point to the value."""
    datatype: uint8 = 0
    """Type of the value: one of INT8 to FLOAT64."""
    count: uint32 = 0
    """Number of values of this type that follow each other; 1 for a single value."""
