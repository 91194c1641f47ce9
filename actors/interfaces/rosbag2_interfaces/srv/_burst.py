"""rosbag2_interfaces/srv/Burst."""

from actors.interfaces.message import Message, Service
from actors.interfaces.types import uint64


class Burst(Service, type_name="rosbag2_interfaces/srv/Burst"):
    """rosbag2_interfaces/srv/Burst."""

    class Request(Message):
        """The request."""

        num_messages: uint64 = 0
        """Messages to publish at once; 0 for all."""

    class Response(Message):
        """The response."""

        actually_burst: uint64 = 0
        """Messages that have been published."""
