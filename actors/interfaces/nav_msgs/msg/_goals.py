"""nav_msgs/msg/Goals."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose_stamped import PoseStamped
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class Goals(Message, type_name="nav_msgs/msg/Goals"):
    """nav_msgs/msg/Goals."""

    header: Header = msgspec.field(default_factory=Header)
    goals: list[PoseStamped] = msgspec.field(default_factory=list[PoseStamped])
