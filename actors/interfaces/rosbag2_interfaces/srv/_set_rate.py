"""rosbag2_interfaces/srv/SetRate."""

from actors.interfaces.message import Message, Service
from actors.interfaces.types import float64


class SetRate(Service, type_name="rosbag2_interfaces/srv/SetRate"):
    """rosbag2_interfaces/srv/SetRate."""

    class Request(Message):
        """The request."""

        rate: float64 = 0.0
        """Seconds of the bag for each second."""

    class Response(Message):
        """The response."""

        success: bool = False
        """Whether the rate was set: it is above 0."""
