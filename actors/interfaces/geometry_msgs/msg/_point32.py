"""geometry_msgs/msg/Point32."""

from actors.interfaces.message import Message
from actors.interfaces.types import float32


class Point32(Message, type_name="geometry_msgs/msg/Point32"):
    """A position in space in single precision, for large clouds."""

    x: float32 = 0.0
    """Position along x, in metres."""
    y: float32 = 0.0
    """Position along y, in metres."""
    z: float32 = 0.0
    """Position along z, in metres."""
