"""example_interfaces/msg/Int16MultiArray."""

import msgspec

from actors.interfaces.example_interfaces.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.message import Message
from actors.interfaces.types import Int16Array, Int16Sequence


class Int16MultiArray(Message, type_name="example_interfaces/msg/Int16MultiArray"):
    """example_interfaces/msg/Int16MultiArray."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    data: Int16Sequence = msgspec.field(default_factory=Int16Array)
