"""nav_msgs/msg/Odometry."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose_with_covariance import PoseWithCovariance
from actors.interfaces.geometry_msgs.msg._twist_with_covariance import TwistWithCovariance
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class Odometry(Message, type_name="nav_msgs/msg/Odometry"):
    """Estimated pose and velocity of a moving robot."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the estimate, and the frame of the pose (usually odom)."""
    child_frame_id: str = ""
    """Frame of the robot that moves (usually base_link); the twist is expressed in it."""
    pose: PoseWithCovariance = msgspec.field(default_factory=PoseWithCovariance)
    """Estimated pose of the child frame in header.frame_id, with covariance."""
    twist: TwistWithCovariance = msgspec.field(default_factory=TwistWithCovariance)
    """Estimated velocity in the frame of child_frame_id, in m/s and rad/s, with covariance."""
