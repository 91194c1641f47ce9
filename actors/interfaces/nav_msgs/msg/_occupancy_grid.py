"""nav_msgs/msg/OccupancyGrid."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.nav_msgs.msg._map_meta_data import MapMetaData
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Int8Array, Int8Sequence


class OccupancyGrid(Message, type_name="nav_msgs/msg/OccupancyGrid"):
    """A grid map with the probability that each cell is occupied."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the map, and the frame that it lies in."""
    info: MapMetaData = msgspec.field(default_factory=MapMetaData)
    """Size, resolution and place of the map."""
    data: Int8Sequence = msgspec.field(default_factory=Int8Array)
    """Row by row from (0, 0), x first: 0 free to 100 occupied, in percent; -1 is unknown."""
