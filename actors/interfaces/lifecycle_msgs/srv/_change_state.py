"""lifecycle_msgs/srv/ChangeState."""

import msgspec

from actors.interfaces.lifecycle_msgs.msg._transition import Transition
from actors.interfaces.message import Message, Service


class ChangeState(Service, type_name="lifecycle_msgs/srv/ChangeState"):
    """lifecycle_msgs/srv/ChangeState."""

    class Request(Message):
        """The request."""

        transition: Transition = msgspec.field(default_factory=Transition)

    class Response(Message):
        """The response."""

        success: bool = False
