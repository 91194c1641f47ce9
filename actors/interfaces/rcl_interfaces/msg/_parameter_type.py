"""rcl_interfaces/msg/ParameterType."""

from typing import ClassVar

from actors.interfaces.message import Message
from actors.interfaces.types import uint8


class ParameterType(Message, type_name="rcl_interfaces/msg/ParameterType"):
    """rcl_interfaces/msg/ParameterType."""

    PARAMETER_NOT_SET: ClassVar[uint8] = 0
    PARAMETER_BOOL: ClassVar[uint8] = 1
    PARAMETER_INTEGER: ClassVar[uint8] = 2
    PARAMETER_DOUBLE: ClassVar[uint8] = 3
    PARAMETER_STRING: ClassVar[uint8] = 4
    PARAMETER_BYTE_ARRAY: ClassVar[uint8] = 5
    PARAMETER_BOOL_ARRAY: ClassVar[uint8] = 6
    PARAMETER_INTEGER_ARRAY: ClassVar[uint8] = 7
    PARAMETER_DOUBLE_ARRAY: ClassVar[uint8] = 8
    PARAMETER_STRING_ARRAY: ClassVar[uint8] = 9
