"""std_msgs/msg/Float32MultiArray."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.types import Float32Array, Float32Sequence


class Float32MultiArray(Message, type_name="std_msgs/msg/Float32MultiArray"):
    """Numbers in single precision as an array of several dimensions."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    """How the elements of data form an array; empty if data is a plain list."""
    data: Float32Sequence = msgspec.field(default_factory=Float32Array)
    """The elements, in the order that layout tells."""
