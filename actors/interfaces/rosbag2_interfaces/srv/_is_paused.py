"""rosbag2_interfaces/srv/IsPaused."""

from actors.interfaces.message import Message, Service


class IsPaused(Service, type_name="rosbag2_interfaces/srv/IsPaused"):
    """rosbag2_interfaces/srv/IsPaused."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        paused: bool = False
        """Whether it is paused."""
