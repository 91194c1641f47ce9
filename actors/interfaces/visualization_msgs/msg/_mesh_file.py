"""visualization_msgs/msg/MeshFile."""

from actors.interfaces.message import Message
from actors.interfaces.types import UInt8Sequence


class MeshFile(Message, type_name="visualization_msgs/msg/MeshFile"):
    """visualization_msgs/msg/MeshFile."""

    filename: str = ""
    data: UInt8Sequence = b""
