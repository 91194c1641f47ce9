"""std_msgs/msg/Int32."""

from actors.interfaces.message import Message
from actors.interfaces.types import int32


class Int32(Message, type_name="std_msgs/msg/Int32"):
    """One signed integer of 32 bits."""

    data: int32 = 0
    """A whole number from -2^31 to 2^31 - 1."""
