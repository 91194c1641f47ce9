"""geometry_msgs/msg/WrenchStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._wrench import Wrench
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class WrenchStamped(Message, type_name="geometry_msgs/msg/WrenchStamped"):
    """geometry_msgs/msg/WrenchStamped."""

    header: Header = msgspec.field(default_factory=Header)
    wrench: Wrench = msgspec.field(default_factory=Wrench)
