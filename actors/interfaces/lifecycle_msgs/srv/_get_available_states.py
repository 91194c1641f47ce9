"""lifecycle_msgs/srv/GetAvailableStates."""

import msgspec

from actors.interfaces.lifecycle_msgs.msg._state import State
from actors.interfaces.message import Message, Service


class GetAvailableStates(Service, type_name="lifecycle_msgs/srv/GetAvailableStates"):
    """lifecycle_msgs/srv/GetAvailableStates."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        available_states: list[State] = msgspec.field(default_factory=list[State])
