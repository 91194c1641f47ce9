"""sensor_msgs/msg/LaserScan."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Float32Array, Float32Sequence, float32


class LaserScan(Message, type_name="sensor_msgs/msg/LaserScan"):
    """sensor_msgs/msg/LaserScan."""

    header: Header = msgspec.field(default_factory=Header)
    angle_min: float32 = 0.0
    angle_max: float32 = 0.0
    angle_increment: float32 = 0.0
    time_increment: float32 = 0.0
    scan_time: float32 = 0.0
    range_min: float32 = 0.0
    range_max: float32 = 0.0
    ranges: Float32Sequence = msgspec.field(default_factory=Float32Array)
    intensities: Float32Sequence = msgspec.field(default_factory=Float32Array)
