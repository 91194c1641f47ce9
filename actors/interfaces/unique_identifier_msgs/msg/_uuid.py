"""unique_identifier_msgs/msg/UUID."""

from typing import Annotated

from actors.interfaces.message import Message
from actors.interfaces.types import Length, UInt8Sequence


class UUID(Message, type_name="unique_identifier_msgs/msg/UUID"):
    """unique_identifier_msgs/msg/UUID."""

    uuid: Annotated[UInt8Sequence, Length(16)] = bytes(16)
