"""geometry_msgs/msg/TwistStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._twist import Twist
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class TwistStamped(Message, type_name="geometry_msgs/msg/TwistStamped"):
    """geometry_msgs/msg/TwistStamped."""

    header: Header = msgspec.field(default_factory=Header)
    twist: Twist = msgspec.field(default_factory=Twist)
