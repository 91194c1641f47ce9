"""rosbag2_interfaces/srv/GetRate."""

from actors.interfaces.message import Message, Service
from actors.interfaces.types import float64


class GetRate(Service, type_name="rosbag2_interfaces/srv/GetRate"):
    """rosbag2_interfaces/srv/GetRate."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        rate: float64 = 0.0
        """Seconds of the bag for each second."""
