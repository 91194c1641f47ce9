"""sensor_msgs/msg/Temperature."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import float64


class Temperature(Message, type_name="sensor_msgs/msg/Temperature"):
    """One measurement of a temperature."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the measurement, and the frame of the sensor."""
    temperature: float64 = 0.0
    """Temperature, in degrees Celsius."""
    variance: float64 = 0.0
    """Variance of the temperature, in (degrees Celsius)^2; 0 means not known."""
