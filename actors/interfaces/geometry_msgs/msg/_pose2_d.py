"""geometry_msgs/msg/Pose2D."""

from actors.interfaces.message import Message
from actors.interfaces.types import float64


class Pose2D(Message, type_name="geometry_msgs/msg/Pose2D"):
    """geometry_msgs/msg/Pose2D."""

    x: float64 = 0.0
    y: float64 = 0.0
    theta: float64 = 0.0
