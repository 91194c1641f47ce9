"""geometry_msgs/msg/PolygonStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._polygon import Polygon
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class PolygonStamped(Message, type_name="geometry_msgs/msg/PolygonStamped"):
    """geometry_msgs/msg/PolygonStamped."""

    header: Header = msgspec.field(default_factory=Header)
    polygon: Polygon = msgspec.field(default_factory=Polygon)
