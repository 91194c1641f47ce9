"""example_interfaces/msg/UInt8MultiArray."""

import msgspec

from actors.interfaces.example_interfaces.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.message import Message
from actors.interfaces.types import UInt8Sequence


class UInt8MultiArray(Message, type_name="example_interfaces/msg/UInt8MultiArray"):
    """example_interfaces/msg/UInt8MultiArray."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    data: UInt8Sequence = b""
