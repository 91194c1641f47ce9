"""visualization_msgs/msg/InteractiveMarkerControl."""

from typing import ClassVar

import msgspec

from actors.interfaces.geometry_msgs.msg._quaternion import Quaternion
from actors.interfaces.message import Message
from actors.interfaces.types import uint8
from actors.interfaces.visualization_msgs.msg._marker import Marker


class InteractiveMarkerControl(Message, type_name="visualization_msgs/msg/InteractiveMarkerControl"):
    """visualization_msgs/msg/InteractiveMarkerControl."""

    INHERIT: ClassVar[uint8] = 0
    FIXED: ClassVar[uint8] = 1
    VIEW_FACING: ClassVar[uint8] = 2
    NONE: ClassVar[uint8] = 0
    MENU: ClassVar[uint8] = 1
    BUTTON: ClassVar[uint8] = 2
    MOVE_AXIS: ClassVar[uint8] = 3
    MOVE_PLANE: ClassVar[uint8] = 4
    ROTATE_AXIS: ClassVar[uint8] = 5
    MOVE_ROTATE: ClassVar[uint8] = 6
    MOVE_3D: ClassVar[uint8] = 7
    ROTATE_3D: ClassVar[uint8] = 8
    MOVE_ROTATE_3D: ClassVar[uint8] = 9

    name: str = ""
    orientation: Quaternion = msgspec.field(default_factory=Quaternion)
    orientation_mode: uint8 = 0
    interaction_mode: uint8 = 0
    always_visible: bool = False
    markers: list[Marker] = msgspec.field(default_factory=list[Marker])
    independent_marker_orientation: bool = False
    description: str = ""
