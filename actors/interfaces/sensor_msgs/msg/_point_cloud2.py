"""sensor_msgs/msg/PointCloud2."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg._point_field import PointField
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import UInt8Sequence, uint32


class PointCloud2(Message, type_name="sensor_msgs/msg/PointCloud2"):
    """Points in space, with any values for each, packed as bytes."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the measurement, and the frame of the points."""
    height: uint32 = 0
    """Rows, if the points form an image; 1 if they have no such order."""
    width: uint32 = 0
    """Points in a row; all points if height is 1."""
    fields: list[PointField] = msgspec.field(default_factory=list[PointField])
    """What the bytes of a point mean."""
    is_bigendian: bool = False
    """True if the numbers in data are big-endian."""
    point_step: uint32 = 0
    """Bytes of a point, with its padding."""
    row_step: uint32 = 0
    """Bytes of a row: width * point_step, plus padding at its end."""
    data: UInt8Sequence = b""
    """The points, row by row: row_step * height bytes."""
    is_dense: bool = False
    """True if every point is valid (no NaN or infinity among them)."""
