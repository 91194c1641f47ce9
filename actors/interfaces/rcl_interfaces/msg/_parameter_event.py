"""rcl_interfaces/msg/ParameterEvent."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.message import Message
from actors.interfaces.rcl_interfaces.msg._parameter import Parameter


class ParameterEvent(Message, type_name="rcl_interfaces/msg/ParameterEvent"):
    """rcl_interfaces/msg/ParameterEvent."""

    stamp: Time = msgspec.field(default_factory=Time)
    node: str = ""
    new_parameters: list[Parameter] = msgspec.field(default_factory=list[Parameter])
    changed_parameters: list[Parameter] = msgspec.field(default_factory=list[Parameter])
    deleted_parameters: list[Parameter] = msgspec.field(default_factory=list[Parameter])
