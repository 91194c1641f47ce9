"""sensor_msgs/msg/PointCloud2."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg._point_field import PointField
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import UInt8Sequence, uint32


class PointCloud2(Message, type_name="sensor_msgs/msg/PointCloud2"):
    """sensor_msgs/msg/PointCloud2."""

    header: Header = msgspec.field(default_factory=Header)
    height: uint32 = 0
    width: uint32 = 0
    fields: list[PointField] = msgspec.field(default_factory=list[PointField])
    is_bigendian: bool = False
    point_step: uint32 = 0
    row_step: uint32 = 0
    data: UInt8Sequence = b""
    is_dense: bool = False
