"""geometry_msgs/msg/AccelWithCovarianceStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._accel_with_covariance import AccelWithCovariance
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class AccelWithCovarianceStamped(Message, type_name="geometry_msgs/msg/AccelWithCovarianceStamped"):
    """An estimated acceleration with its uncertainty, time and frame."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the acceleration, and the frame in which it is expressed."""
    accel: AccelWithCovariance = msgspec.field(default_factory=AccelWithCovariance)
    """Acceleration and its covariance in the frame of header.frame_id."""
