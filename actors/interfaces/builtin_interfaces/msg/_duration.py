"""builtin_interfaces/msg/Duration."""

from actors.interfaces.message import Message
from actors.interfaces.types import int32, uint32


class Duration(Message, type_name="builtin_interfaces/msg/Duration"):
    """A length of time, which may be negative."""

    sec: int32 = 0
    """Whole seconds, rounded down: -0.5 s is sec -1 and nanosec 500000000."""
    nanosec: uint32 = 0
    """Nanoseconds to add to sec, from 0 to 999999999."""
