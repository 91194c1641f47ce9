"""rosbag2_interfaces/srv/PlayNext."""

from actors.interfaces.message import Message, Service


class PlayNext(Service, type_name="rosbag2_interfaces/srv/PlayNext"):
    """rosbag2_interfaces/srv/PlayNext."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        success: bool = False
        """Whether a message has been published: only a paused player does."""
