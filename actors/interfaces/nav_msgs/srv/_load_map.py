"""nav_msgs/srv/LoadMap."""

from typing import ClassVar

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.nav_msgs.msg._occupancy_grid import OccupancyGrid
from actors.interfaces.types import uint8


class LoadMap(Service, type_name="nav_msgs/srv/LoadMap"):
    """Load a map from a file."""

    class Request(Message):
        """The request."""

        map_url: str = ""
        """Where the map's file is: an absolute path, or a file:// or package:// URL."""

    class Response(Message):
        """The response."""

        RESULT_SUCCESS: ClassVar[uint8] = 0
        """The map was loaded."""
        RESULT_MAP_DOES_NOT_EXIST: ClassVar[uint8] = 1
        """There is no map at map_url."""
        RESULT_INVALID_MAP_DATA: ClassVar[uint8] = 2
        """The map's image cannot be read."""
        RESULT_INVALID_MAP_METADATA: ClassVar[uint8] = 3
        """The description of the map is wrong or incomplete."""
        RESULT_UNDEFINED_FAILURE: ClassVar[uint8] = 255
        """It failed for another reason."""

        map: OccupancyGrid = msgspec.field(default_factory=OccupancyGrid)
        """The loaded map; valid only if result is RESULT_SUCCESS."""
        result: uint8 = 0
        """What happened: one of RESULT_*."""
