"""geometry_msgs/msg/Polygon."""

import msgspec

from actors.interfaces.geometry_msgs.msg._point32 import Point32
from actors.interfaces.message import Message


class Polygon(Message, type_name="geometry_msgs/msg/Polygon"):
    """A closed outline."""

    points: list[Point32] = msgspec.field(default_factory=list[Point32])
    """Corners in order, in metres; an edge joins the last one to the first."""
