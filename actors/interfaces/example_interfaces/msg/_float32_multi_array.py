"""example_interfaces/msg/Float32MultiArray."""

import msgspec

from actors.interfaces.example_interfaces.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.message import Message
from actors.interfaces.types import Float32Array, Float32Sequence


class Float32MultiArray(Message, type_name="example_interfaces/msg/Float32MultiArray"):
    """example_interfaces/msg/Float32MultiArray."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    data: Float32Sequence = msgspec.field(default_factory=Float32Array)
