"""geometry_msgs/msg/PolygonStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._polygon import Polygon
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class PolygonStamped(Message, type_name="geometry_msgs/msg/PolygonStamped"):
    """A closed outline with its time and frame."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the polygon, and the frame in which it is expressed."""
    polygon: Polygon = msgspec.field(default_factory=Polygon)
    """The outline in the frame of header.frame_id, in metres."""
