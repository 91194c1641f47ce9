"""std_msgs/msg/Char."""

from actors.interfaces.message import Message
from actors.interfaces.types import char


class Char(Message, type_name="std_msgs/msg/Char"):
    """std_msgs/msg/Char."""

    data: char = 0
