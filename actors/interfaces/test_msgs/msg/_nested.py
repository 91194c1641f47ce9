"""test_msgs/msg/Nested."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.test_msgs.msg._basic_types import BasicTypes


class Nested(Message, type_name="test_msgs/msg/Nested"):
    """test_msgs/msg/Nested."""

    basic_types_value: BasicTypes = msgspec.field(default_factory=BasicTypes)
