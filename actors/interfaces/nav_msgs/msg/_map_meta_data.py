"""nav_msgs/msg/MapMetaData."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.geometry_msgs.msg._pose import Pose
from actors.interfaces.message import Message
from actors.interfaces.types import float32, uint32


class MapMetaData(Message, type_name="nav_msgs/msg/MapMetaData"):
    """nav_msgs/msg/MapMetaData."""

    map_load_time: Time = msgspec.field(default_factory=Time)
    resolution: float32 = 0.0
    width: uint32 = 0
    height: uint32 = 0
    origin: Pose = msgspec.field(default_factory=Pose)
