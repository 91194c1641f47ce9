"""example_interfaces/msg/Int8MultiArray."""

import msgspec

from actors.interfaces.example_interfaces.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.message import Message
from actors.interfaces.types import Int8Array, Int8Sequence


class Int8MultiArray(Message, type_name="example_interfaces/msg/Int8MultiArray"):
    """example_interfaces/msg/Int8MultiArray."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    data: Int8Sequence = msgspec.field(default_factory=Int8Array)
