"""builtin_interfaces/msg/Time."""

from actors.interfaces.message import Message
from actors.interfaces.types import int32, uint32


class Time(Message, type_name="builtin_interfaces/msg/Time"):
    """A moment, in seconds and nanoseconds."""

    sec: int32 = 0
    """Whole seconds since the epoch: 1970 for wall clocks, another start for simulated time."""
    nanosec: uint32 = 0
    """Nanoseconds after sec, from 0 to 999999999."""
