"""std_msgs/msg/Int8."""

from actors.interfaces.message import Message
from actors.interfaces.types import int8


class Int8(Message, type_name="std_msgs/msg/Int8"):
    """One signed integer of 8 bits."""

    data: int8 = 0
    """A whole number from -128 to 127."""
