"""std_msgs/msg/Int32MultiArray."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.types import Int32Array, Int32Sequence


class Int32MultiArray(Message, type_name="std_msgs/msg/Int32MultiArray"):
    """Signed integers of 32 bits as an array of several dimensions."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    """How the elements of data form an array; empty if data is a plain list."""
    data: Int32Sequence = msgspec.field(default_factory=Int32Array)
    """The elements, in the order that layout tells."""
