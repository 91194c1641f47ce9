"""sensor_msgs/msg/Illuminance."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import float64


class Illuminance(Message, type_name="sensor_msgs/msg/Illuminance"):
    """One measurement of ambient light."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the measurement, and the frame of the sensor (light arrives along x)."""
    illuminance: float64 = 0.0
    """Illuminance (weighted as the human eye sees light), in lux."""
    variance: float64 = 0.0
    """Variance of the illuminance, in lux^2; 0 means not known."""
