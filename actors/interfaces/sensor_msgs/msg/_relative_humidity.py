"""sensor_msgs/msg/RelativeHumidity."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import float64


class RelativeHumidity(Message, type_name="sensor_msgs/msg/RelativeHumidity"):
    """sensor_msgs/msg/RelativeHumidity."""

    header: Header = msgspec.field(default_factory=Header)
    relative_humidity: float64 = 0.0
    variance: float64 = 0.0
