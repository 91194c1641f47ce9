"""example_interfaces/msg/UInt32MultiArray."""

import msgspec

from actors.interfaces.example_interfaces.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.message import Message
from actors.interfaces.types import UInt32Array, UInt32Sequence


class UInt32MultiArray(Message, type_name="example_interfaces/msg/UInt32MultiArray"):
    """example_interfaces/msg/UInt32MultiArray."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    data: UInt32Sequence = msgspec.field(default_factory=UInt32Array)
