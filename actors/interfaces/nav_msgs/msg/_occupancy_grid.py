"""nav_msgs/msg/OccupancyGrid."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.nav_msgs.msg._map_meta_data import MapMetaData
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Int8Array, Int8Sequence


class OccupancyGrid(Message, type_name="nav_msgs/msg/OccupancyGrid"):
    """nav_msgs/msg/OccupancyGrid."""

    header: Header = msgspec.field(default_factory=Header)
    info: MapMetaData = msgspec.field(default_factory=MapMetaData)
    data: Int8Sequence = msgspec.field(default_factory=Int8Array)
