"""sensor_msgs/msg/Image."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import UInt8Sequence, uint8, uint32


class Image(Message, type_name="sensor_msgs/msg/Image"):
    """One image, not compressed."""

    header: Header = msgspec.field(default_factory=Header)
    """Time when the image was taken; optical frame of the camera (x right, y down, z forward)."""
    height: uint32 = 0
    """Number of rows, in pixels."""
    width: uint32 = 0
    """Number of columns, in pixels."""
    encoding: str = ""
    """What a pixel is: channels and bits, such as rgb8, bgr8, mono8, 16UC1 or 32FC1."""
    is_bigendian: uint8 = 0
    """1 if values of several bytes are big-endian, 0 if little-endian."""
    step: uint32 = 0
    """Bytes of a row, with its padding."""
    data: UInt8Sequence = b""
    """Pixels row by row from the top left corner: step * height bytes."""
