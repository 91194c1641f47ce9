"""geometry_msgs/msg/VelocityStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._twist import Twist
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class VelocityStamped(Message, type_name="geometry_msgs/msg/VelocityStamped"):
    """geometry_msgs/msg/VelocityStamped."""

    header: Header = msgspec.field(default_factory=Header)
    body_frame_id: str = ""
    reference_frame_id: str = ""
    velocity: Twist = msgspec.field(default_factory=Twist)
