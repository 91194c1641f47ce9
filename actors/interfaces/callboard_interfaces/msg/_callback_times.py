"""callboard_interfaces/msg/CallbackTimes."""

from actors.interfaces.message import Message
from actors.interfaces.types import float64, uint64


class CallbackTimes(Message, type_name="callboard_interfaces/msg/CallbackTimes"):
    """callboard_interfaces/msg/CallbackTimes."""

    kind: str = ""
    source: str = ""
    name: str = ""
    calls: uint64 = 0
    busy_sec: float64 = 0.0
    longest_sec: float64 = 0.0
    longest_elapsed_sec: float64 = 0.0
    slow: uint64 = 0
