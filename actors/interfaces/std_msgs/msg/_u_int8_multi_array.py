"""std_msgs/msg/UInt8MultiArray."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.types import UInt8Sequence


class UInt8MultiArray(Message, type_name="std_msgs/msg/UInt8MultiArray"):
    """Unsigned integers of 8 bits as an array of several dimensions."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    """How the elements of data form an array; empty if data is a plain list."""
    data: UInt8Sequence = b""
    """The elements, in the order that layout tells."""
