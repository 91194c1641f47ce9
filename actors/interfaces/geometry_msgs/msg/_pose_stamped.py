"""geometry_msgs/msg/PoseStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose import Pose
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class PoseStamped(Message, type_name="geometry_msgs/msg/PoseStamped"):
    """A pose with its time and frame."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the pose, and the frame in which it is expressed."""
    pose: Pose = msgspec.field(default_factory=Pose)
    """Position in metres and orientation, in the frame of header.frame_id."""
