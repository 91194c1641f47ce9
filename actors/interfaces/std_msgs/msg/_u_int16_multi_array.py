"""std_msgs/msg/UInt16MultiArray."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.types import UInt16Array, UInt16Sequence


class UInt16MultiArray(Message, type_name="std_msgs/msg/UInt16MultiArray"):
    """Unsigned integers of 16 bits as an array of several dimensions."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    """How the elements of data form an array; empty if data is a plain list."""
    data: UInt16Sequence = msgspec.field(default_factory=UInt16Array)
    """The elements, in the order that layout tells."""
