"""visualization_msgs/msg/InteractiveMarkerFeedback."""

from typing import ClassVar

import msgspec

from actors.interfaces.geometry_msgs.msg._point import Point
from actors.interfaces.geometry_msgs.msg._pose import Pose
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import uint8, uint32


class InteractiveMarkerFeedback(Message, type_name="visualization_msgs/msg/InteractiveMarkerFeedback"):
    """visualization_msgs/msg/InteractiveMarkerFeedback."""

    KEEP_ALIVE: ClassVar[uint8] = 0
    POSE_UPDATE: ClassVar[uint8] = 1
    MENU_SELECT: ClassVar[uint8] = 2
    BUTTON_CLICK: ClassVar[uint8] = 3
    MOUSE_DOWN: ClassVar[uint8] = 4
    MOUSE_UP: ClassVar[uint8] = 5

    header: Header = msgspec.field(default_factory=Header)
    client_id: str = ""
    marker_name: str = ""
    control_name: str = ""
    event_type: uint8 = 0
    pose: Pose = msgspec.field(default_factory=Pose)
    menu_entry_id: uint32 = 0
    mouse_point: Point = msgspec.field(default_factory=Point)
    mouse_point_valid: bool = False
