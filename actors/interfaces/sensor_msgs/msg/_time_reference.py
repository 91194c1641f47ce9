"""sensor_msgs/msg/TimeReference."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class TimeReference(Message, type_name="sensor_msgs/msg/TimeReference"):
    """The time of an external clock, next to this computer's."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of this computer when the reference was read; the frame is not used."""
    time_ref: Time = msgspec.field(default_factory=Time)
    """Time of the external clock at that moment."""
    source: str = ""
    """Name of the external clock, such as gps."""
