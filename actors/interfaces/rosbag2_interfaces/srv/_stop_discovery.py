"""rosbag2_interfaces/srv/StopDiscovery."""

from actors.interfaces.message import Message, Service
from actors.interfaces.types import int32


class StopDiscovery(Service, type_name="rosbag2_interfaces/srv/StopDiscovery"):
    """rosbag2_interfaces/srv/StopDiscovery."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        return_code: int32 = 0
        """0; 1 if discovery does not run."""
        error_string: str = ""
        """Why the code is not 0."""
