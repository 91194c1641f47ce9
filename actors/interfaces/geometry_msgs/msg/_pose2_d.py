"""geometry_msgs/msg/Pose2D."""

from actors.interfaces.message import Message
from actors.interfaces.types import float64


class Pose2D(Message, type_name="geometry_msgs/msg/Pose2D"):
    """A position and a heading in the plane."""

    x: float64 = 0.0
    """Position along x, in metres."""
    y: float64 = 0.0
    """Position along y, in metres."""
    theta: float64 = 0.0
    """Rotation about z, in radians, counter-clockwise."""
