"""std_srvs/srv/Empty."""

from actors.interfaces.message import Message, Service


class Empty(Service, type_name="std_srvs/srv/Empty"):
    """std_srvs/srv/Empty."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""
