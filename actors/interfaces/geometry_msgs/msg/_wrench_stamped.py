"""geometry_msgs/msg/WrenchStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._wrench import Wrench
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class WrenchStamped(Message, type_name="geometry_msgs/msg/WrenchStamped"):
    """A force and a torque with their time and frame."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the measurement, and the frame in which it is expressed."""
    wrench: Wrench = msgspec.field(default_factory=Wrench)
    """Force in newtons and torque in newton metres, in the frame of header.frame_id."""
