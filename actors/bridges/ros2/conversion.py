"""What converts the messages of a topic, and names of nodes in them.

With a bridge's namespace a node has another name on each side. Lines of the log and parameter events name
their node, and their topics have one name on both sides: only the names inside the messages can differ.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.interfaces.cdr import codec_for as cdr_codec_for
from actors.interfaces.codec import codec_for
from actors.interfaces.rcl_interfaces.msg import Log, ParameterEvent

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.bridges.ros2.types import MessageTypes

_NODE_FIELDS: Final = {"/rosout": (Log, "name", "."), "/parameter_events": (ParameterEvent, "node", "/")}
"""By topic: its type, the field that names a node, and the separator of the parts of the name there."""


def converter(types: MessageTypes, topic: str, prefix: str, *, from_ros: bool) -> Callable[[bytes], bytes]:
    """Return the function that converts the messages of a topic.

    Args:
        types: The topic's type.
        topic: Its name.
        prefix: The namespace before callboard's names, such as "/robot1"; "" for none.
        from_ros: Whether the messages come from ROS 2: they are CDR then, and the result is msgpack.

    Returns:
        A function that raises InvalidMessageError for a message that cannot be converted.
    """
    cls, field, separator = _NODE_FIELDS.get(topic, (None, "", ""))
    if not prefix or types.ours is not cls:
        return types.to_callboard if from_ros else types.to_ros
    cdr, msgpack = cdr_codec_for(types.ours), codec_for(types.ours)
    added = prefix if separator == "/" else prefix[1:].replace("/", separator)

    def convert_from_ros(data: bytes) -> bytes:
        message: Any = cdr.decode(data)
        name = getattr(message, field)
        setattr(message, field, added + name if name.startswith("/") else f"{added}{separator}{name}")
        return msgpack.encode(message)

    def convert_to_ros(data: bytes) -> bytes:
        message: Any = msgpack.decode(data)
        name = getattr(message, field)
        if name.startswith(added + separator):
            inner = name[len(added) :]
            setattr(message, field, inner if separator == "/" else inner[1:])
        return cdr.encode(message)

    return convert_from_ros if from_ros else convert_to_ros
