"""rcl_interfaces/msg/ParameterDescriptor."""

from typing import Annotated

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.rcl_interfaces.msg._floating_point_range import FloatingPointRange
from actors.interfaces.rcl_interfaces.msg._integer_range import IntegerRange
from actors.interfaces.types import AtMost, uint8


class ParameterDescriptor(Message, type_name="rcl_interfaces/msg/ParameterDescriptor"):
    """rcl_interfaces/msg/ParameterDescriptor."""

    name: str = ""
    type: uint8 = 0
    description: str = ""
    additional_constraints: str = ""
    read_only: bool = False
    dynamic_typing: bool = False
    floating_point_range: Annotated[list[FloatingPointRange], AtMost(1)] = msgspec.field(
        default_factory=list[FloatingPointRange]
    )
    integer_range: Annotated[list[IntegerRange], AtMost(1)] = msgspec.field(
        default_factory=list[IntegerRange]
    )
