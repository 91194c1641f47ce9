"""sensor_msgs/msg/JointState."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Float64Array, Float64Sequence


class JointState(Message, type_name="sensor_msgs/msg/JointState"):
    """sensor_msgs/msg/JointState."""

    header: Header = msgspec.field(default_factory=Header)
    name: list[str] = msgspec.field(default_factory=list[str])
    position: Float64Sequence = msgspec.field(default_factory=Float64Array)
    velocity: Float64Sequence = msgspec.field(default_factory=Float64Array)
    effort: Float64Sequence = msgspec.field(default_factory=Float64Array)
