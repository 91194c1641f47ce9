"""sensor_msgs/msg/TimeReference."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class TimeReference(Message, type_name="sensor_msgs/msg/TimeReference"):
    """sensor_msgs/msg/TimeReference."""

    header: Header = msgspec.field(default_factory=Header)
    time_ref: Time = msgspec.field(default_factory=Time)
    source: str = ""
