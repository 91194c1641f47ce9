"""geometry_msgs/msg/TransformStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._transform import Transform
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class TransformStamped(Message, type_name="geometry_msgs/msg/TransformStamped"):
    """geometry_msgs/msg/TransformStamped."""

    header: Header = msgspec.field(default_factory=Header)
    child_frame_id: str = ""
    transform: Transform = msgspec.field(default_factory=Transform)
