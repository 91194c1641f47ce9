"""builtin_interfaces/msg/Duration."""

from actors.interfaces.message import Message
from actors.interfaces.types import int32, uint32


class Duration(Message, type_name="builtin_interfaces/msg/Duration"):
    """builtin_interfaces/msg/Duration."""

    sec: int32 = 0
    nanosec: uint32 = 0
