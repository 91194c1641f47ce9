"""std_msgs/msg/Int32."""

from actors.interfaces.message import Message
from actors.interfaces.types import int32


class Int32(Message, type_name="std_msgs/msg/Int32"):
    """std_msgs/msg/Int32."""

    data: int32 = 0
