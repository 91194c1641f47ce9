"""rosbag2_interfaces/srv/Resume."""

from actors.interfaces.message import Message, Service


class Resume(Service, type_name="rosbag2_interfaces/srv/Resume"):
    """rosbag2_interfaces/srv/Resume."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""
