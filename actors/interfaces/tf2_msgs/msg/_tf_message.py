"""tf2_msgs/msg/TFMessage."""

import msgspec

from actors.interfaces.geometry_msgs.msg._transform_stamped import TransformStamped
from actors.interfaces.message import Message


class TFMessage(Message, type_name="tf2_msgs/msg/TFMessage"):
    """tf2_msgs/msg/TFMessage."""

    transforms: list[TransformStamped] = msgspec.field(default_factory=list[TransformStamped])
