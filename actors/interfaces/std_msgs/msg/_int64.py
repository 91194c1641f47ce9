"""std_msgs/msg/Int64."""

from actors.interfaces.message import Message
from actors.interfaces.types import int64


class Int64(Message, type_name="std_msgs/msg/Int64"):
    """One signed integer of 64 bits."""

    data: int64 = 0
    """A whole number from -2^63 to 2^63 - 1."""
