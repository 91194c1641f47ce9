"""std_msgs/msg/Char."""

from actors.interfaces.message import Message
from actors.interfaces.types import char


class Char(Message, type_name="std_msgs/msg/Char"):
    """One character code."""

    data: char = 0
    """A number from 0 to 255, usually the code of a character."""
