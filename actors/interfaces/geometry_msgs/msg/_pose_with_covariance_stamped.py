"""geometry_msgs/msg/PoseWithCovarianceStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose_with_covariance import PoseWithCovariance
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class PoseWithCovarianceStamped(Message, type_name="geometry_msgs/msg/PoseWithCovarianceStamped"):
    """An estimated pose with its uncertainty, time and frame."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the estimate, and the frame in which it is expressed."""
    pose: PoseWithCovariance = msgspec.field(default_factory=PoseWithCovariance)
    """Pose and its covariance in the frame of header.frame_id."""
