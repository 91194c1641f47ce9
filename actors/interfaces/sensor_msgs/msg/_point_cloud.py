"""sensor_msgs/msg/PointCloud."""

import msgspec

from actors.interfaces.geometry_msgs.msg._point32 import Point32
from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg._channel_float32 import ChannelFloat32
from actors.interfaces.std_msgs.msg._header import Header


class PointCloud(Message, type_name="sensor_msgs/msg/PointCloud"):
    """Points in space; PointCloud2 has replaced it."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the measurement, and the frame of the points."""
    points: list[Point32] = msgspec.field(default_factory=list[Point32])
    """Points in the frame of header.frame_id, in metres."""
    channels: list[ChannelFloat32] = msgspec.field(default_factory=list[ChannelFloat32])
    """Further values of the points, such as intensities."""
