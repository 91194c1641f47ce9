"""nav_msgs/msg/Goals."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose_stamped import PoseStamped
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class Goals(Message, type_name="nav_msgs/msg/Goals"):
    """Poses for a robot to visit."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the request, and the frame for the whole list."""
    goals: list[PoseStamped] = msgspec.field(default_factory=list[PoseStamped])
    """Poses to reach, in this order, each with a frame of its own."""
