"""nav_msgs/msg/GridCells."""

import msgspec

from actors.interfaces.geometry_msgs.msg._point import Point
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import float32


class GridCells(Message, type_name="nav_msgs/msg/GridCells"):
    """A set of equal rectangular cells."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the grid, and the frame of its cells."""
    cell_width: float32 = 0.0
    """Size of a cell along x, in metres."""
    cell_height: float32 = 0.0
    """Size of a cell along y, in metres."""
    cells: list[Point] = msgspec.field(default_factory=list[Point])
    """Centres of the cells in the frame of header.frame_id, in metres."""
