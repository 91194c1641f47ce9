"""std_msgs/msg/Header."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.message import Message


class Header(Message, type_name="std_msgs/msg/Header"):
    """When and in which frame data was taken."""

    stamp: Time = msgspec.field(default_factory=Time)
    """Time that the data belongs to."""
    frame_id: str = ""
    """Name of the coordinate frame of the data."""
