"""sensor_msgs/msg/FluidPressure."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import float64


class FluidPressure(Message, type_name="sensor_msgs/msg/FluidPressure"):
    """One measurement of the pressure of air or another fluid."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the measurement, and the frame of the sensor."""
    fluid_pressure: float64 = 0.0
    """Pressure above vacuum, in pascals."""
    variance: float64 = 0.0
    """Variance of the pressure, in Pa^2; 0 means not known."""
