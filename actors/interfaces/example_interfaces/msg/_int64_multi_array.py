"""example_interfaces/msg/Int64MultiArray."""

import msgspec

from actors.interfaces.example_interfaces.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.message import Message
from actors.interfaces.types import Int64Array, Int64Sequence


class Int64MultiArray(Message, type_name="example_interfaces/msg/Int64MultiArray"):
    """example_interfaces/msg/Int64MultiArray."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    data: Int64Sequence = msgspec.field(default_factory=Int64Array)
