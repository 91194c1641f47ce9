"""tf2_msgs/msg/TFMessage."""

import msgspec

from actors.interfaces.geometry_msgs.msg._transform_stamped import TransformStamped
from actors.interfaces.message import Message


class TFMessage(Message, type_name="tf2_msgs/msg/TFMessage"):
    """Transforms that were sent together, as on /tf and /tf_static."""

    transforms: list[TransformStamped] = msgspec.field(default_factory=list[TransformStamped])
    """Transforms between pairs of frames, each with a time of its own."""
