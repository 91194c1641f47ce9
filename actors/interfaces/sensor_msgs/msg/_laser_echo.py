"""sensor_msgs/msg/LaserEcho."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.types import Float32Array, Float32Sequence


class LaserEcho(Message, type_name="sensor_msgs/msg/LaserEcho"):
    """All echoes of one beam."""

    echoes: Float32Sequence = msgspec.field(default_factory=Float32Array)
    """All echoes of one beam: ranges in metres, or intensities, as the field around it says."""
