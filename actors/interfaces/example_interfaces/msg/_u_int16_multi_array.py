"""example_interfaces/msg/UInt16MultiArray."""

import msgspec

from actors.interfaces.example_interfaces.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.message import Message
from actors.interfaces.types import UInt16Array, UInt16Sequence


class UInt16MultiArray(Message, type_name="example_interfaces/msg/UInt16MultiArray"):
    """example_interfaces/msg/UInt16MultiArray."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    data: UInt16Sequence = msgspec.field(default_factory=UInt16Array)
