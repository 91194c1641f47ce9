"""std_msgs/msg/UInt64MultiArray."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.types import UInt64Array, UInt64Sequence


class UInt64MultiArray(Message, type_name="std_msgs/msg/UInt64MultiArray"):
    """Unsigned integers of 64 bits as an array of several dimensions."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    """How the elements of data form an array; empty if data is a plain list."""
    data: UInt64Sequence = msgspec.field(default_factory=UInt64Array)
    """The elements, in the order that layout tells."""
