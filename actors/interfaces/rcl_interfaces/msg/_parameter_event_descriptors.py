"""rcl_interfaces/msg/ParameterEventDescriptors."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.rcl_interfaces.msg._parameter_descriptor import ParameterDescriptor


class ParameterEventDescriptors(Message, type_name="rcl_interfaces/msg/ParameterEventDescriptors"):
    """rcl_interfaces/msg/ParameterEventDescriptors."""

    new_parameters: list[ParameterDescriptor] = msgspec.field(default_factory=list[ParameterDescriptor])
    changed_parameters: list[ParameterDescriptor] = msgspec.field(default_factory=list[ParameterDescriptor])
    deleted_parameters: list[ParameterDescriptor] = msgspec.field(default_factory=list[ParameterDescriptor])
