"""sensor_msgs/msg/CompressedImage."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import UInt8Sequence


class CompressedImage(Message, type_name="sensor_msgs/msg/CompressedImage"):
    """sensor_msgs/msg/CompressedImage."""

    header: Header = msgspec.field(default_factory=Header)
    format: str = ""
    data: UInt8Sequence = b""
