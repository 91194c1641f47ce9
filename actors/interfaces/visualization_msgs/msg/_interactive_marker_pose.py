"""visualization_msgs/msg/InteractiveMarkerPose."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose import Pose
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class InteractiveMarkerPose(Message, type_name="visualization_msgs/msg/InteractiveMarkerPose"):
    """visualization_msgs/msg/InteractiveMarkerPose."""

    header: Header = msgspec.field(default_factory=Header)
    pose: Pose = msgspec.field(default_factory=Pose)
    name: str = ""
