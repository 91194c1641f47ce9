"""tf2_msgs/srv/FrameGraph."""

from actors.interfaces.message import Message, Service


class FrameGraph(Service, type_name="tf2_msgs/srv/FrameGraph"):
    """tf2_msgs/srv/FrameGraph."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        frame_yaml: str = ""
