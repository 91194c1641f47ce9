"""geometry_msgs/msg/PointStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._point import Point
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class PointStamped(Message, type_name="geometry_msgs/msg/PointStamped"):
    """geometry_msgs/msg/PointStamped."""

    header: Header = msgspec.field(default_factory=Header)
    point: Point = msgspec.field(default_factory=Point)
