"""nav_msgs/srv/LoadMap."""

from typing import ClassVar

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.nav_msgs.msg._occupancy_grid import OccupancyGrid
from actors.interfaces.types import uint8


class LoadMap(Service, type_name="nav_msgs/srv/LoadMap"):
    """nav_msgs/srv/LoadMap."""

    class Request(Message):
        """The request."""

        map_url: str = ""

    class Response(Message):
        """The response."""

        RESULT_SUCCESS: ClassVar[uint8] = 0
        RESULT_MAP_DOES_NOT_EXIST: ClassVar[uint8] = 1
        RESULT_INVALID_MAP_DATA: ClassVar[uint8] = 2
        RESULT_INVALID_MAP_METADATA: ClassVar[uint8] = 3
        RESULT_UNDEFINED_FAILURE: ClassVar[uint8] = 255

        map: OccupancyGrid = msgspec.field(default_factory=OccupancyGrid)
        result: uint8 = 0
