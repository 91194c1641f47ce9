"""nav_msgs/srv/GetMap."""

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.nav_msgs.msg._occupancy_grid import OccupancyGrid


class GetMap(Service, type_name="nav_msgs/srv/GetMap"):
    """nav_msgs/srv/GetMap."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        map: OccupancyGrid = msgspec.field(default_factory=OccupancyGrid)
