"""geometry_msgs/msg/PoseArray."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose import Pose
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class PoseArray(Message, type_name="geometry_msgs/msg/PoseArray"):
    """Poses that share one time and frame."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the poses, and the frame in which all of them are expressed."""
    poses: list[Pose] = msgspec.field(default_factory=list[Pose])
    """Poses in the frame of header.frame_id; positions in metres."""
