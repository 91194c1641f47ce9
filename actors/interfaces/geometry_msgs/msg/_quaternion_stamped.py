"""geometry_msgs/msg/QuaternionStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._quaternion import Quaternion
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class QuaternionStamped(Message, type_name="geometry_msgs/msg/QuaternionStamped"):
    """An orientation with its time and frame."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the orientation, and the frame that it is relative to."""
    quaternion: Quaternion = msgspec.field(default_factory=Quaternion)
    """Orientation relative to the frame of header.frame_id, as a unit quaternion."""
