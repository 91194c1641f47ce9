"""geometry_msgs/msg/AccelWithCovarianceStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._accel_with_covariance import AccelWithCovariance
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class AccelWithCovarianceStamped(Message, type_name="geometry_msgs/msg/AccelWithCovarianceStamped"):
    """geometry_msgs/msg/AccelWithCovarianceStamped."""

    header: Header = msgspec.field(default_factory=Header)
    accel: AccelWithCovariance = msgspec.field(default_factory=AccelWithCovariance)
