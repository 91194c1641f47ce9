"""std_msgs/msg/UInt32MultiArray."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._multi_array_layout import MultiArrayLayout
from actors.interfaces.types import UInt32Array, UInt32Sequence


class UInt32MultiArray(Message, type_name="std_msgs/msg/UInt32MultiArray"):
    """std_msgs/msg/UInt32MultiArray."""

    layout: MultiArrayLayout = msgspec.field(default_factory=MultiArrayLayout)
    data: UInt32Sequence = msgspec.field(default_factory=UInt32Array)
