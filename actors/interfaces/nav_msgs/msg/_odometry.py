"""nav_msgs/msg/Odometry."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose_with_covariance import PoseWithCovariance
from actors.interfaces.geometry_msgs.msg._twist_with_covariance import TwistWithCovariance
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class Odometry(Message, type_name="nav_msgs/msg/Odometry"):
    """nav_msgs/msg/Odometry."""

    header: Header = msgspec.field(default_factory=Header)
    child_frame_id: str = ""
    pose: PoseWithCovariance = msgspec.field(default_factory=PoseWithCovariance)
    twist: TwistWithCovariance = msgspec.field(default_factory=TwistWithCovariance)
