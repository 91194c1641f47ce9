"""rosbag2_interfaces/srv/Seek."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.message import Message, Service


class Seek(Service, type_name="rosbag2_interfaces/srv/Seek"):
    """rosbag2_interfaces/srv/Seek."""

    class Request(Message):
        """The request."""

        time: Time = msgspec.field(default_factory=Time)
        """Time of the bag to go to."""

    class Response(Message):
        """The response."""

        success: bool = False
        """Whether the bag has that time."""
