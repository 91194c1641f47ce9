"""rcl_interfaces/msg/Parameter."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.rcl_interfaces.msg._parameter_value import ParameterValue


class Parameter(Message, type_name="rcl_interfaces/msg/Parameter"):
    """rcl_interfaces/msg/Parameter."""

    name: str = ""
    value: ParameterValue = msgspec.field(default_factory=ParameterValue)
