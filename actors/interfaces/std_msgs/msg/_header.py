"""std_msgs/msg/Header."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.message import Message


class Header(Message, type_name="std_msgs/msg/Header"):
    """std_msgs/msg/Header."""

    stamp: Time = msgspec.field(default_factory=Time)
    frame_id: str = ""
