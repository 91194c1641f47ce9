"""test_msgs/srv/Empty."""

from actors.interfaces.message import Message, Service


class Empty(Service, type_name="test_msgs/srv/Empty"):
    """test_msgs/srv/Empty."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""
