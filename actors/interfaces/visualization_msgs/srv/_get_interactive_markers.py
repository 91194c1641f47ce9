"""visualization_msgs/srv/GetInteractiveMarkers."""

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.types import uint64
from actors.interfaces.visualization_msgs.msg._interactive_marker import InteractiveMarker


class GetInteractiveMarkers(Service, type_name="visualization_msgs/srv/GetInteractiveMarkers"):
    """visualization_msgs/srv/GetInteractiveMarkers."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        sequence_number: uint64 = 0
        markers: list[InteractiveMarker] = msgspec.field(default_factory=list[InteractiveMarker])
