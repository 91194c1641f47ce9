"""std_msgs/msg/Float64MultiArray."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.types import Float64Array, Float64Sequence


class Float64MultiArray(Message, type_name="std_msgs/msg/Float64MultiArray"):
    """std_msgs/msg/Float64MultiArray."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    data: Float64Sequence = msgspec.field(default_factory=Float64Array)
