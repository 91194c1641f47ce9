"""std_msgs/msg/Int16MultiArray."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.types import Int16Array, Int16Sequence


class Int16MultiArray(Message, type_name="std_msgs/msg/Int16MultiArray"):
    """Signed integers of 16 bits as an array of several dimensions."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    """How the elements of data form an array; empty if data is a plain list."""
    data: Int16Sequence = msgspec.field(default_factory=Int16Array)
    """The elements, in the order that layout tells."""
