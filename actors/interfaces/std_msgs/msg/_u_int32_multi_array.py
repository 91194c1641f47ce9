"""std_msgs/msg/UInt32MultiArray."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.types import UInt32Array, UInt32Sequence


class UInt32MultiArray(Message, type_name="std_msgs/msg/UInt32MultiArray"):
    """Unsigned integers of 32 bits as an array of several dimensions."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    """How the elements of data form an array; empty if data is a plain list."""
    data: UInt32Sequence = msgspec.field(default_factory=UInt32Array)
    """The elements, in the order that layout tells."""
