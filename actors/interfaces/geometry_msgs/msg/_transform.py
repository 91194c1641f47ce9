"""geometry_msgs/msg/Transform."""

import msgspec

from actors.interfaces.geometry_msgs.msg._quaternion import Quaternion
from actors.interfaces.geometry_msgs.msg._vector3 import Vector3
from actors.interfaces.message import Message


class Transform(Message, type_name="geometry_msgs/msg/Transform"):
    """A translation and a rotation between two frames."""

    translation: Vector3 = msgspec.field(default_factory=Vector3)
    """Position of the child frame in the parent frame, in metres."""
    rotation: Quaternion = msgspec.field(default_factory=Quaternion)
    """Orientation of the child frame in the parent frame, as a unit quaternion."""
