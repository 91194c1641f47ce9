"""example_interfaces/msg/UInt64MultiArray."""

import msgspec

from actors.interfaces.example_interfaces.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.message import Message
from actors.interfaces.types import UInt64Array, UInt64Sequence


class UInt64MultiArray(Message, type_name="example_interfaces/msg/UInt64MultiArray"):
    """example_interfaces/msg/UInt64MultiArray."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    data: UInt64Sequence = msgspec.field(default_factory=UInt64Array)
