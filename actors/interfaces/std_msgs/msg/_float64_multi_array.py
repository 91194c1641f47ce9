"""std_msgs/msg/Float64MultiArray."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.types import Float64Array, Float64Sequence


class Float64MultiArray(Message, type_name="std_msgs/msg/Float64MultiArray"):
    """Numbers in double precision as an array of several dimensions."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    """How the elements of data form an array; empty if data is a plain list."""
    data: Float64Sequence = msgspec.field(default_factory=Float64Array)
    """The elements, in the order that layout tells."""
