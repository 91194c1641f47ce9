"""rosbag2_interfaces/srv/SplitBagfile."""

from actors.interfaces.message import Message, Service


class SplitBagfile(Service, type_name="rosbag2_interfaces/srv/SplitBagfile"):
    """rosbag2_interfaces/srv/SplitBagfile."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""
