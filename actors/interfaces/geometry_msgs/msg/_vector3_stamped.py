"""geometry_msgs/msg/Vector3Stamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._vector3 import Vector3
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class Vector3Stamped(Message, type_name="geometry_msgs/msg/Vector3Stamped"):
    """geometry_msgs/msg/Vector3Stamped."""

    header: Header = msgspec.field(default_factory=Header)
    vector: Vector3 = msgspec.field(default_factory=Vector3)
