"""geometry_msgs/msg/PolygonInstance."""

import msgspec

from actors.interfaces.geometry_msgs.msg._polygon import Polygon
from actors.interfaces.message import Message
from actors.interfaces.types import int64


class PolygonInstance(Message, type_name="geometry_msgs/msg/PolygonInstance"):
    """A closed outline with a number."""

    polygon: Polygon = msgspec.field(default_factory=Polygon)
    """The outline, in metres."""
    id: int64 = 0
    """Number that tells this polygon from others."""
