"""visualization_msgs/msg/InteractiveMarkerInit."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.types import uint64
from actors.interfaces.visualization_msgs.msg._interactive_marker import InteractiveMarker


class InteractiveMarkerInit(Message, type_name="visualization_msgs/msg/InteractiveMarkerInit"):
    """visualization_msgs/msg/InteractiveMarkerInit."""

    server_id: str = ""
    seq_num: uint64 = 0
    markers: list[InteractiveMarker] = msgspec.field(default_factory=list[InteractiveMarker])
