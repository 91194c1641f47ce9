"""geometry_msgs/msg/PointStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._point import Point
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class PointStamped(Message, type_name="geometry_msgs/msg/PointStamped"):
    """A position with its time and frame."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the position, and the frame in which it is expressed."""
    point: Point = msgspec.field(default_factory=Point)
    """Position in the frame of header.frame_id, in metres."""
