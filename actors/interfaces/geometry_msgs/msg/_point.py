"""geometry_msgs/msg/Point."""

from actors.interfaces.message import Message
from actors.interfaces.types import float64


class Point(Message, type_name="geometry_msgs/msg/Point"):
    """A position in space."""

    x: float64 = 0.0
    """Position along x, in metres."""
    y: float64 = 0.0
    """Position along y, in metres."""
    z: float64 = 0.0
    """Position along z, in metres."""
