"""example_interfaces/msg/Int16."""

from actors.interfaces.message import Message
from actors.interfaces.types import int16


class Int16(Message, type_name="example_interfaces/msg/Int16"):
    """example_interfaces/msg/Int16."""

    data: int16 = 0
