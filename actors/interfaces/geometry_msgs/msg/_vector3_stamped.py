"""geometry_msgs/msg/Vector3Stamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._vector3 import Vector3
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class Vector3Stamped(Message, type_name="geometry_msgs/msg/Vector3Stamped"):
    """A vector with its time and frame."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the vector, and the frame in which it is expressed."""
    vector: Vector3 = msgspec.field(default_factory=Vector3)
    """Vector in the frame of header.frame_id; only its direction and length count."""
