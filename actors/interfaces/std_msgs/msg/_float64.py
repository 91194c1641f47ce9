"""std_msgs/msg/Float64."""

from actors.interfaces.message import Message
from actors.interfaces.types import float64


class Float64(Message, type_name="std_msgs/msg/Float64"):
    """One number in double precision."""

    data: float64 = 0.0
    """A number in double precision (about 15 digits)."""
