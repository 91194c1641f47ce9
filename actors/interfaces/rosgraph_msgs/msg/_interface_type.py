"""rosgraph_msgs/msg/InterfaceType."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.rosgraph_msgs.msg._type_hash import TypeHash


class InterfaceType(Message, type_name="rosgraph_msgs/msg/InterfaceType"):
    """rosgraph_msgs/msg/InterfaceType."""

    name: str = ""
    hash: TypeHash = msgspec.field(default_factory=TypeHash)
