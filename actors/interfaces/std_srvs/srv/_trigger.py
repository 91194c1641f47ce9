"""std_srvs/srv/Trigger."""

from actors.interfaces.message import Message, Service


class Trigger(Service, type_name="std_srvs/srv/Trigger"):
    """std_srvs/srv/Trigger."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        success: bool = False
        message: str = ""
