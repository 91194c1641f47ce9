"""rosbag2_interfaces/srv/IsDiscoveryRunning."""

from actors.interfaces.message import Message, Service


class IsDiscoveryRunning(Service, type_name="rosbag2_interfaces/srv/IsDiscoveryRunning"):
    """rosbag2_interfaces/srv/IsDiscoveryRunning."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        running: bool = False
        """Whether new topics are recorded."""
