"""std_msgs/msg/UInt8MultiArray."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.types import UInt8Sequence


class UInt8MultiArray(Message, type_name="std_msgs/msg/UInt8MultiArray"):
    """std_msgs/msg/UInt8MultiArray."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    data: UInt8Sequence = b""
