"""builtin_interfaces/msg/Time."""

from actors.interfaces.message import Message
from actors.interfaces.types import int32, uint32


class Time(Message, type_name="builtin_interfaces/msg/Time"):
    """builtin_interfaces/msg/Time."""

    sec: int32 = 0
    nanosec: uint32 = 0
