"""lifecycle_msgs/srv/GetAvailableTransitions."""

import msgspec

from actors.interfaces.lifecycle_msgs.msg._transition_description import TransitionDescription
from actors.interfaces.message import Message, Service


class GetAvailableTransitions(Service, type_name="lifecycle_msgs/srv/GetAvailableTransitions"):
    """lifecycle_msgs/srv/GetAvailableTransitions."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        available_transitions: list[TransitionDescription] = msgspec.field(
            default_factory=list[TransitionDescription]
        )
