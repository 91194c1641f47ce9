"""rosbag2_interfaces/srv/Snapshot."""

from actors.interfaces.message import Message, Service


class Snapshot(Service, type_name="rosbag2_interfaces/srv/Snapshot"):
    """rosbag2_interfaces/srv/Snapshot."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        success: bool = False
        """Whether the messages in memory have been written."""
