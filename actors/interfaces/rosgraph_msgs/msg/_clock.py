"""rosgraph_msgs/msg/Clock."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.message import Message


class Clock(Message, type_name="rosgraph_msgs/msg/Clock"):
    """rosgraph_msgs/msg/Clock."""

    clock: Time = msgspec.field(default_factory=Time)
