"""geometry_msgs/msg/TransformStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._transform import Transform
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class TransformStamped(Message, type_name="geometry_msgs/msg/TransformStamped"):
    """The transform of one frame in another at one moment, as on /tf."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the transform, and the parent frame."""
    child_frame_id: str = ""
    """Name of the child frame."""
    transform: Transform = msgspec.field(default_factory=Transform)
    """Place of the child frame in header.frame_id: it takes coordinates from child to parent."""
