"""nav_msgs/srv/SetMap."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose_with_covariance_stamped import PoseWithCovarianceStamped
from actors.interfaces.message import Message, Service
from actors.interfaces.nav_msgs.msg._occupancy_grid import OccupancyGrid


class SetMap(Service, type_name="nav_msgs/srv/SetMap"):
    """Replace the map, and say where the robot is in it."""

    class Request(Message):
        """The request."""

        map: OccupancyGrid = msgspec.field(default_factory=OccupancyGrid)
        """Map to use from now on."""
        initial_pose: PoseWithCovarianceStamped = msgspec.field(default_factory=PoseWithCovarianceStamped)
        """Pose of the robot in the new map, with covariance."""

    class Response(Message):
        """The response."""

        success: bool = False
        """True if the map is in use now."""
