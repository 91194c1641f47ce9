"""std_msgs/msg/Int64MultiArray."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.types import Int64Array, Int64Sequence


class Int64MultiArray(Message, type_name="std_msgs/msg/Int64MultiArray"):
    """Signed integers of 64 bits as an array of several dimensions."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    """How the elements of data form an array; empty if data is a plain list."""
    data: Int64Sequence = msgspec.field(default_factory=Int64Array)
    """The elements, in the order that layout tells."""
