"""geometry_msgs/msg/TwistWithCovarianceStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._twist_with_covariance import TwistWithCovariance
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class TwistWithCovarianceStamped(Message, type_name="geometry_msgs/msg/TwistWithCovarianceStamped"):
    """An estimated velocity with its uncertainty, time and frame."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the estimate, and the frame in which it is expressed."""
    twist: TwistWithCovariance = msgspec.field(default_factory=TwistWithCovariance)
    """Velocity and its covariance in the frame of header.frame_id."""
