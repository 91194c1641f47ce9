"""visualization_msgs/msg/InteractiveMarkerUpdate."""

from typing import ClassVar

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.types import uint8, uint64
from actors.interfaces.visualization_msgs.msg._interactive_marker import InteractiveMarker
from actors.interfaces.visualization_msgs.msg._interactive_marker_pose import InteractiveMarkerPose


class InteractiveMarkerUpdate(Message, type_name="visualization_msgs/msg/InteractiveMarkerUpdate"):
    """visualization_msgs/msg/InteractiveMarkerUpdate."""

    KEEP_ALIVE: ClassVar[uint8] = 0
    UPDATE: ClassVar[uint8] = 1

    server_id: str = ""
    seq_num: uint64 = 0
    type: uint8 = 0
    markers: list[InteractiveMarker] = msgspec.field(default_factory=list[InteractiveMarker])
    poses: list[InteractiveMarkerPose] = msgspec.field(default_factory=list[InteractiveMarkerPose])
    erases: list[str] = msgspec.field(default_factory=list[str])
