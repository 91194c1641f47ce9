"""rosbag2_interfaces/srv/Play."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._duration import Duration
from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.message import Message, Service


class Play(Service, type_name="rosbag2_interfaces/srv/Play"):
    """rosbag2_interfaces/srv/Play."""

    class Request(Message):
        """The request."""

        start_offset: Time = msgspec.field(default_factory=Time)
        """Time after the beginning of the bag to begin at."""
        playback_duration: Duration = msgspec.field(default_factory=Duration)
        """Length of the part to play; negative for no limit."""
        playback_until_timestamp: Time = msgspec.field(default_factory=Time)
        """Time of the bag to stop at; negative for its end."""

    class Response(Message):
        """The response."""

        success: bool = False
        """Whether it plays: only one at a time can."""
