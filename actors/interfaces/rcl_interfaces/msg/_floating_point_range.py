"""rcl_interfaces/msg/FloatingPointRange."""

from actors.interfaces.message import Message
from actors.interfaces.types import float64


class FloatingPointRange(Message, type_name="rcl_interfaces/msg/FloatingPointRange"):
    """rcl_interfaces/msg/FloatingPointRange."""

    from_value: float64 = 0.0
    to_value: float64 = 0.0
    step: float64 = 0.0
