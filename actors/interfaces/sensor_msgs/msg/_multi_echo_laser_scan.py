"""sensor_msgs/msg/MultiEchoLaserScan."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg._laser_echo import LaserEcho
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import float32


class MultiEchoLaserScan(Message, type_name="sensor_msgs/msg/MultiEchoLaserScan"):
    """sensor_msgs/msg/MultiEchoLaserScan."""

    header: Header = msgspec.field(default_factory=Header)
    angle_min: float32 = 0.0
    angle_max: float32 = 0.0
    angle_increment: float32 = 0.0
    time_increment: float32 = 0.0
    scan_time: float32 = 0.0
    range_min: float32 = 0.0
    range_max: float32 = 0.0
    ranges: list[LaserEcho] = msgspec.field(default_factory=list[LaserEcho])
    intensities: list[LaserEcho] = msgspec.field(default_factory=list[LaserEcho])
