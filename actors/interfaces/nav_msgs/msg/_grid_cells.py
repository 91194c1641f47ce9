"""nav_msgs/msg/GridCells."""

import msgspec

from actors.interfaces.geometry_msgs.msg._point import Point
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import float32


class GridCells(Message, type_name="nav_msgs/msg/GridCells"):
    """nav_msgs/msg/GridCells."""

    header: Header = msgspec.field(default_factory=Header)
    cell_width: float32 = 0.0
    cell_height: float32 = 0.0
    cells: list[Point] = msgspec.field(default_factory=list[Point])
