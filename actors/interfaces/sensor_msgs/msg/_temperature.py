"""sensor_msgs/msg/Temperature."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import float64


class Temperature(Message, type_name="sensor_msgs/msg/Temperature"):
    """sensor_msgs/msg/Temperature."""

    header: Header = msgspec.field(default_factory=Header)
    temperature: float64 = 0.0
    variance: float64 = 0.0
