"""geometry_msgs/msg/AccelStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._accel import Accel
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class AccelStamped(Message, type_name="geometry_msgs/msg/AccelStamped"):
    """An acceleration with its time and frame."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the acceleration, and the frame in which it is expressed."""
    accel: Accel = msgspec.field(default_factory=Accel)
    """Acceleration in the frame of header.frame_id, in m/s^2 and rad/s^2."""
