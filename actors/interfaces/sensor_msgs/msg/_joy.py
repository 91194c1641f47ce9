"""sensor_msgs/msg/Joy."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Float32Array, Float32Sequence, Int32Array, Int32Sequence


class Joy(Message, type_name="sensor_msgs/msg/Joy"):
    """sensor_msgs/msg/Joy."""

    header: Header = msgspec.field(default_factory=Header)
    axes: Float32Sequence = msgspec.field(default_factory=Float32Array)
    buttons: Int32Sequence = msgspec.field(default_factory=Int32Array)
