"""geometry_msgs/msg/PolygonInstanceStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._polygon_instance import PolygonInstance
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class PolygonInstanceStamped(Message, type_name="geometry_msgs/msg/PolygonInstanceStamped"):
    """A numbered outline with its time and frame."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the polygon, and the frame in which it is expressed."""
    polygon: PolygonInstance = msgspec.field(default_factory=PolygonInstance)
    """The polygon and its number, in the frame of header.frame_id."""
