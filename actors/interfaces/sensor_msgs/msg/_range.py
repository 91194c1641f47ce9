"""sensor_msgs/msg/Range."""

from typing import ClassVar

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import float32, uint8


class Range(Message, type_name="sensor_msgs/msg/Range"):
    """sensor_msgs/msg/Range."""

    ULTRASOUND: ClassVar[uint8] = 0
    INFRARED: ClassVar[uint8] = 1

    header: Header = msgspec.field(default_factory=Header)
    radiation_type: uint8 = 0
    field_of_view: float32 = 0.0
    min_range: float32 = 0.0
    max_range: float32 = 0.0
    range: float32 = 0.0
    variance: float32 = 0.0
