"""sensor_msgs/msg/Range."""

from typing import ClassVar

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import float32, uint8


class Range(Message, type_name="sensor_msgs/msg/Range"):
    """One distance from an ultrasonic or infrared sensor."""

    ULTRASOUND: ClassVar[uint8] = 0
    """The sensor measures with sound."""
    INFRARED: ClassVar[uint8] = 1
    """The sensor measures with infrared light."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the measurement; frame of the sensor, which looks along x."""
    radiation_type: uint8 = 0
    """What the sensor measures with: ULTRASOUND or INFRARED."""
    field_of_view: float32 = 0.0
    """Angle of the cone in which an object is detected, in radians."""
    min_range: float32 = 0.0
    """Shortest range that is valid, in metres."""
    max_range: float32 = 0.0
    """Longest range that is valid, in metres; equal to min_range for a yes-or-no sensor."""
    range: float32 = 0.0
    """Distance in metres; a yes-or-no sensor gives -Inf for an object and +Inf for none."""
    variance: float32 = 0.0
    """Variance of the range, in m^2; 0 means not known."""
