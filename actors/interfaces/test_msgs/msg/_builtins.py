"""test_msgs/msg/Builtins."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._duration import Duration
from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.message import Message


class Builtins(Message, type_name="test_msgs/msg/Builtins"):
    """test_msgs/msg/Builtins."""

    duration_value: Duration = msgspec.field(default_factory=Duration)
    time_value: Time = msgspec.field(default_factory=Time)
