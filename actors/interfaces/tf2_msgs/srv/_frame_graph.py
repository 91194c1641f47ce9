"""tf2_msgs/srv/FrameGraph."""

from actors.interfaces.message import Message, Service


class FrameGraph(Service, type_name="tf2_msgs/srv/FrameGraph"):
    """Ask for all frames that a node knows."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        frame_yaml: str = ""
        """All known frames with parents, rates and ages, as YAML."""
