"""std_msgs/msg/ByteMultiArray."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.types import ByteSequence


class ByteMultiArray(Message, type_name="std_msgs/msg/ByteMultiArray"):
    """std_msgs/msg/ByteMultiArray."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    data: ByteSequence = b""
