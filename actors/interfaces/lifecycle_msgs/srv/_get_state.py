"""lifecycle_msgs/srv/GetState."""

import msgspec

from actors.interfaces.lifecycle_msgs.msg._state import State
from actors.interfaces.message import Message, Service


class GetState(Service, type_name="lifecycle_msgs/srv/GetState"):
    """lifecycle_msgs/srv/GetState."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        current_state: State = msgspec.field(default_factory=State)
