"""rosbag2_interfaces/srv/TogglePaused."""

from actors.interfaces.message import Message, Service


class TogglePaused(Service, type_name="rosbag2_interfaces/srv/TogglePaused"):
    """rosbag2_interfaces/srv/TogglePaused."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""
