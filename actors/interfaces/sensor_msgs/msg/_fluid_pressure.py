"""sensor_msgs/msg/FluidPressure."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import float64


class FluidPressure(Message, type_name="sensor_msgs/msg/FluidPressure"):
    """sensor_msgs/msg/FluidPressure."""

    header: Header = msgspec.field(default_factory=Header)
    fluid_pressure: float64 = 0.0
    variance: float64 = 0.0
