"""geometry_msgs/msg/QuaternionStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._quaternion import Quaternion
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class QuaternionStamped(Message, type_name="geometry_msgs/msg/QuaternionStamped"):
    """geometry_msgs/msg/QuaternionStamped."""

    header: Header = msgspec.field(default_factory=Header)
    quaternion: Quaternion = msgspec.field(default_factory=Quaternion)
