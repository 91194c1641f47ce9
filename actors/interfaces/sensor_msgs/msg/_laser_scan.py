"""sensor_msgs/msg/LaserScan."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Float32Array, Float32Sequence, float32


class LaserScan(Message, type_name="sensor_msgs/msg/LaserScan"):
    """One sweep of a planar laser scanner."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the first beam; frame of the scanner, which turns about z."""
    angle_min: float32 = 0.0
    """Angle of the first beam from x towards y, in radians."""
    angle_max: float32 = 0.0
    """Angle of the last beam from x towards y, in radians."""
    angle_increment: float32 = 0.0
    """Angle from one beam to the next, in radians; negative if it turns clockwise."""
    time_increment: float32 = 0.0
    """Time from one beam to the next, in seconds; 0 if they are simultaneous."""
    scan_time: float32 = 0.0
    """Time from one scan to the next, in seconds."""
    range_min: float32 = 0.0
    """Shortest range that is valid, in metres."""
    range_max: float32 = 0.0
    """Longest range that is valid, in metres."""
    ranges: Float32Sequence = msgspec.field(default_factory=Float32Array)
    """Range of each beam, in metres; only those from range_min to range_max are valid."""
    intensities: Float32Sequence = msgspec.field(default_factory=Float32Array)
    """Strength of each beam's echo, in a unit of the device; empty if it gives none."""
