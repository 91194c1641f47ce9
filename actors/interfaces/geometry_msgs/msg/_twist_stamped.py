"""geometry_msgs/msg/TwistStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._twist import Twist
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class TwistStamped(Message, type_name="geometry_msgs/msg/TwistStamped"):
    """A velocity with its time and frame."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the velocity, and the frame in which it is expressed."""
    twist: Twist = msgspec.field(default_factory=Twist)
    """Velocity in the frame of header.frame_id, in m/s and rad/s."""
