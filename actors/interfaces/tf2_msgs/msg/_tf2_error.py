"""tf2_msgs/msg/TF2Error."""

from typing import ClassVar

from actors.interfaces.message import Message
from actors.interfaces.types import uint8


class TF2Error(Message, type_name="tf2_msgs/msg/TF2Error"):
    """tf2_msgs/msg/TF2Error."""

    NO_ERROR: ClassVar[uint8] = 0
    LOOKUP_ERROR: ClassVar[uint8] = 1
    CONNECTIVITY_ERROR: ClassVar[uint8] = 2
    EXTRAPOLATION_ERROR: ClassVar[uint8] = 3
    INVALID_ARGUMENT_ERROR: ClassVar[uint8] = 4
    TIMEOUT_ERROR: ClassVar[uint8] = 5
    TRANSFORM_ERROR: ClassVar[uint8] = 6

    error: uint8 = 0
    error_string: str = ""
