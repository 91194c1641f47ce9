"""rosbag2_interfaces/srv/Pause."""

from actors.interfaces.message import Message, Service


class Pause(Service, type_name="rosbag2_interfaces/srv/Pause"):
    """rosbag2_interfaces/srv/Pause."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""
