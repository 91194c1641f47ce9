"""geometry_msgs/msg/PoseArray."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose import Pose
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class PoseArray(Message, type_name="geometry_msgs/msg/PoseArray"):
    """geometry_msgs/msg/PoseArray."""

    header: Header = msgspec.field(default_factory=Header)
    poses: list[Pose] = msgspec.field(default_factory=list[Pose])
