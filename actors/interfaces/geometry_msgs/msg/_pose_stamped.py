"""geometry_msgs/msg/PoseStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose import Pose
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class PoseStamped(Message, type_name="geometry_msgs/msg/PoseStamped"):
    """geometry_msgs/msg/PoseStamped."""

    header: Header = msgspec.field(default_factory=Header)
    pose: Pose = msgspec.field(default_factory=Pose)
