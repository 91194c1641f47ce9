"""rcl_interfaces/msg/IntegerRange."""

from actors.interfaces.message import Message
from actors.interfaces.types import int64, uint64


class IntegerRange(Message, type_name="rcl_interfaces/msg/IntegerRange"):
    """rcl_interfaces/msg/IntegerRange."""

    from_value: int64 = 0
    to_value: int64 = 0
    step: uint64 = 0
