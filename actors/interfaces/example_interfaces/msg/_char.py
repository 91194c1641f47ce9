"""example_interfaces/msg/Char."""

from actors.interfaces.message import Message
from actors.interfaces.types import char


class Char(Message, type_name="example_interfaces/msg/Char"):
    """example_interfaces/msg/Char."""

    data: char = 0
