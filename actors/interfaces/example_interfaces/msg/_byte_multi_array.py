"""example_interfaces/msg/ByteMultiArray."""

import msgspec

from actors.interfaces.example_interfaces.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.message import Message
from actors.interfaces.types import ByteSequence


class ByteMultiArray(Message, type_name="example_interfaces/msg/ByteMultiArray"):
    """example_interfaces/msg/ByteMultiArray."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    data: ByteSequence = b""
