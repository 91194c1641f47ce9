"""rosbag2_interfaces/srv/StartDiscovery."""

from actors.interfaces.message import Message, Service
from actors.interfaces.types import int32


class StartDiscovery(Service, type_name="rosbag2_interfaces/srv/StartDiscovery"):
    """rosbag2_interfaces/srv/StartDiscovery."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        return_code: int32 = 0
        """0; 1 if discovery runs already, or cannot be started."""
        error_string: str = ""
        """Why the code is not 0."""
