"""geometry_msgs/msg/VelocityStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._twist import Twist
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class VelocityStamped(Message, type_name="geometry_msgs/msg/VelocityStamped"):
    """The velocity of one frame relative to another, expressed in a third."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the velocity, and the frame in which its components are expressed."""
    body_frame_id: str = ""
    """Name of the frame that moves."""
    reference_frame_id: str = ""
    """Name of the frame relative to which it moves."""
    velocity: Twist = msgspec.field(default_factory=Twist)
    """Velocity of the body, along and about the axes of header.frame_id, in m/s and rad/s."""
