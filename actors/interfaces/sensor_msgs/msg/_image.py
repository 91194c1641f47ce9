"""sensor_msgs/msg/Image."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import UInt8Sequence, uint8, uint32


class Image(Message, type_name="sensor_msgs/msg/Image"):
    """sensor_msgs/msg/Image."""

    header: Header = msgspec.field(default_factory=Header)
    height: uint32 = 0
    width: uint32 = 0
    encoding: str = ""
    is_bigendian: uint8 = 0
    step: uint32 = 0
    data: UInt8Sequence = b""
