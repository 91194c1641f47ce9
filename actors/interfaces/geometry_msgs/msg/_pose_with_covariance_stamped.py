"""geometry_msgs/msg/PoseWithCovarianceStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose_with_covariance import PoseWithCovariance
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class PoseWithCovarianceStamped(Message, type_name="geometry_msgs/msg/PoseWithCovarianceStamped"):
    """geometry_msgs/msg/PoseWithCovarianceStamped."""

    header: Header = msgspec.field(default_factory=Header)
    pose: PoseWithCovariance = msgspec.field(default_factory=PoseWithCovariance)
