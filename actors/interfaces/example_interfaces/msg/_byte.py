"""example_interfaces/msg/Byte."""

from actors.interfaces.message import Message
from actors.interfaces.types import byte


class Byte(Message, type_name="example_interfaces/msg/Byte"):
    """example_interfaces/msg/Byte."""

    data: byte = b"\x00"
