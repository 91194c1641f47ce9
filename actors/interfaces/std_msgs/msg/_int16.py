"""std_msgs/msg/Int16."""

from actors.interfaces.message import Message
from actors.interfaces.types import int16


class Int16(Message, type_name="std_msgs/msg/Int16"):
    """One signed integer of 16 bits."""

    data: int16 = 0
    """A whole number from -32768 to 32767."""
