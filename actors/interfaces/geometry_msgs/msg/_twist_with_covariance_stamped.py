"""geometry_msgs/msg/TwistWithCovarianceStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._twist_with_covariance import TwistWithCovariance
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class TwistWithCovarianceStamped(Message, type_name="geometry_msgs/msg/TwistWithCovarianceStamped"):
    """geometry_msgs/msg/TwistWithCovarianceStamped."""

    header: Header = msgspec.field(default_factory=Header)
    twist: TwistWithCovariance = msgspec.field(default_factory=TwistWithCovariance)
