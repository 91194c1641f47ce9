"""rosgraph_msgs/msg/TypeHash."""

from typing import Annotated

from actors.interfaces.message import Message
from actors.interfaces.types import Length, UInt8Sequence, uint8


class TypeHash(Message, type_name="rosgraph_msgs/msg/TypeHash"):
    """rosgraph_msgs/msg/TypeHash."""

    version: uint8 = 0
    value: Annotated[UInt8Sequence, Length(32)] = bytes(32)
