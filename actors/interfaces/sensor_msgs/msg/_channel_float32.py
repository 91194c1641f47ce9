"""sensor_msgs/msg/ChannelFloat32."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.types import Float32Array, Float32Sequence


class ChannelFloat32(Message, type_name="sensor_msgs/msg/ChannelFloat32"):
    """sensor_msgs/msg/ChannelFloat32."""

    name: str = ""
    values: Float32Sequence = msgspec.field(default_factory=Float32Array)
