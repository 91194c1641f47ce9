"""sensor_msgs/msg/RelativeHumidity."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import float64


class RelativeHumidity(Message, type_name="sensor_msgs/msg/RelativeHumidity"):
    """One measurement of the humidity of air."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the measurement, and the frame of the sensor."""
    relative_humidity: float64 = 0.0
    """Relative humidity, from 0 (dry) to 1 (saturated)."""
    variance: float64 = 0.0
    """Variance of the relative humidity, without unit; 0 means not known."""
