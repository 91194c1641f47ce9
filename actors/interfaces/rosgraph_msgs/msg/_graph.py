"""rosgraph_msgs/msg/Graph."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.rosgraph_msgs.msg._node import Node


class Graph(Message, type_name="rosgraph_msgs/msg/Graph"):
    """rosgraph_msgs/msg/Graph."""

    nodes: list[Node] = msgspec.field(default_factory=list[Node])
