"""geometry_msgs/msg/AccelStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._accel import Accel
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class AccelStamped(Message, type_name="geometry_msgs/msg/AccelStamped"):
    """geometry_msgs/msg/AccelStamped."""

    header: Header = msgspec.field(default_factory=Header)
    accel: Accel = msgspec.field(default_factory=Accel)
