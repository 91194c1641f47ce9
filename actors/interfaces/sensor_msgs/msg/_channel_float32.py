"""sensor_msgs/msg/ChannelFloat32."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.types import Float32Array, Float32Sequence


class ChannelFloat32(Message, type_name="sensor_msgs/msg/ChannelFloat32"):
    """One further value for each point of a PointCloud."""

    name: str = ""
    """What the values are, such as intensity or rgb."""
    values: Float32Sequence = msgspec.field(default_factory=Float32Array)
    """One value for each point of the cloud, in the same order."""
