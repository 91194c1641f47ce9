"""nav_msgs/srv/GetMap."""

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.nav_msgs.msg._occupancy_grid import OccupancyGrid


class GetMap(Service, type_name="nav_msgs/srv/GetMap"):
    """Ask for the current map."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        map: OccupancyGrid = msgspec.field(default_factory=OccupancyGrid)
        """The current map."""
