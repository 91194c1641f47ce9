"""sensor_msgs/msg/Illuminance."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import float64


class Illuminance(Message, type_name="sensor_msgs/msg/Illuminance"):
    """sensor_msgs/msg/Illuminance."""

    header: Header = msgspec.field(default_factory=Header)
    illuminance: float64 = 0.0
    variance: float64 = 0.0
