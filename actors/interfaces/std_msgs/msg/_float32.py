"""std_msgs/msg/Float32."""

from actors.interfaces.message import Message
from actors.interfaces.types import float32


class Float32(Message, type_name="std_msgs/msg/Float32"):
    """One number in single precision."""

    data: float32 = 0.0
    """A number in single precision (about 7 digits)."""
