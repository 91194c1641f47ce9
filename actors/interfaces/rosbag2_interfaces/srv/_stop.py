"""rosbag2_interfaces/srv/Stop."""

from actors.interfaces.message import Message, Service


class Stop(Service, type_name="rosbag2_interfaces/srv/Stop"):
    """rosbag2_interfaces/srv/Stop."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""
