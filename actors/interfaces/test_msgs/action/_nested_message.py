"""test_msgs/action/NestedMessage."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.message import Action, Message
from actors.interfaces.test_msgs.msg._basic_types import BasicTypes
from actors.interfaces.test_msgs.msg._builtins import Builtins


class NestedMessage(Action, type_name="test_msgs/action/NestedMessage"):
    """test_msgs/action/NestedMessage."""

    class Goal(Message):
        """The goal."""

        nested_field_no_pkg: Builtins = msgspec.field(default_factory=Builtins)
        nested_field: BasicTypes = msgspec.field(default_factory=BasicTypes)
        nested_different_pkg: Time = msgspec.field(default_factory=Time)

    class Result(Message):
        """The result."""

        nested_field_no_pkg: Builtins = msgspec.field(default_factory=Builtins)
        nested_field: BasicTypes = msgspec.field(default_factory=BasicTypes)
        nested_different_pkg: Time = msgspec.field(default_factory=Time)

    class Feedback(Message):
        """The feedback."""

        nested_field_no_pkg: Builtins = msgspec.field(default_factory=Builtins)
        nested_field: BasicTypes = msgspec.field(default_factory=BasicTypes)
        nested_different_pkg: Time = msgspec.field(default_factory=Time)
