"""example_interfaces/msg/Int32MultiArray."""

import msgspec

from actors.interfaces.example_interfaces.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.message import Message
from actors.interfaces.types import Int32Array, Int32Sequence


class Int32MultiArray(Message, type_name="example_interfaces/msg/Int32MultiArray"):
    """example_interfaces/msg/Int32MultiArray."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    data: Int32Sequence = msgspec.field(default_factory=Int32Array)
