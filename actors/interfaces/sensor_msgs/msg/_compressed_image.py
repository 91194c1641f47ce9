"""sensor_msgs/msg/CompressedImage."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import UInt8Sequence


class CompressedImage(Message, type_name="sensor_msgs/msg/CompressedImage"):
    """One image, compressed."""

    header: Header = msgspec.field(default_factory=Header)
    """Time when the image was taken; optical frame of the camera (x right, y down, z forward)."""
    format: str = ""
    """Codec, such as jpeg or png; image_transport writes "rgb8; jpeg compressed bgr8"."""
    data: UInt8Sequence = b""
    """The compressed image, as the bytes of its file."""
