"""example_interfaces/msg/Float64."""

from actors.interfaces.message import Message
from actors.interfaces.types import float64


class Float64(Message, type_name="example_interfaces/msg/Float64"):
    """example_interfaces/msg/Float64."""

    data: float64 = 0.0
