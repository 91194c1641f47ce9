"""nav_msgs/msg/MapMetaData."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.geometry_msgs.msg._pose import Pose
from actors.interfaces.message import Message
from actors.interfaces.types import float32, uint32


class MapMetaData(Message, type_name="nav_msgs/msg/MapMetaData"):
    """Size, resolution and place of a grid map."""

    map_load_time: Time = msgspec.field(default_factory=Time)
    """Time when the map was loaded."""
    resolution: float32 = 0.0
    """Edge length of a cell, in metres."""
    width: uint32 = 0
    """Number of cells along x."""
    height: uint32 = 0
    """Number of cells along y."""
    origin: Pose = msgspec.field(default_factory=Pose)
    """Pose of the outer corner of cell (0, 0) in the map's frame, in metres."""
