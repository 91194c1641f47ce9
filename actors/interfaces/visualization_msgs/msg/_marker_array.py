"""visualization_msgs/msg/MarkerArray."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.visualization_msgs.msg._marker import Marker


class MarkerArray(Message, type_name="visualization_msgs/msg/MarkerArray"):
    """visualization_msgs/msg/MarkerArray."""

    markers: list[Marker] = msgspec.field(default_factory=list[Marker])
