"""example_interfaces/msg/Int64."""

from actors.interfaces.message import Message
from actors.interfaces.types import int64


class Int64(Message, type_name="example_interfaces/msg/Int64"):
    """example_interfaces/msg/Int64."""

    data: int64 = 0
