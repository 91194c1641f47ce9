"""nav_msgs/srv/SetMap."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose_with_covariance_stamped import PoseWithCovarianceStamped
from actors.interfaces.message import Message, Service
from actors.interfaces.nav_msgs.msg._occupancy_grid import OccupancyGrid


class SetMap(Service, type_name="nav_msgs/srv/SetMap"):
    """nav_msgs/srv/SetMap."""

    class Request(Message):
        """The request."""

        map: OccupancyGrid = msgspec.field(default_factory=OccupancyGrid)
        initial_pose: PoseWithCovarianceStamped = msgspec.field(default_factory=PoseWithCovarianceStamped)

    class Response(Message):
        """The response."""

        success: bool = False
