"""geometry_msgs/msg/PolygonInstanceStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._polygon_instance import PolygonInstance
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class PolygonInstanceStamped(Message, type_name="geometry_msgs/msg/PolygonInstanceStamped"):
    """geometry_msgs/msg/PolygonInstanceStamped."""

    header: Header = msgspec.field(default_factory=Header)
    polygon: PolygonInstance = msgspec.field(default_factory=PolygonInstance)
