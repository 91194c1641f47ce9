"""std_srvs/srv/SetBool."""

from actors.interfaces.message import Message, Service


class SetBool(Service, type_name="std_srvs/srv/SetBool"):
    """std_srvs/srv/SetBool."""

    class Request(Message):
        """The request."""

        data: bool = False

    class Response(Message):
        """The response."""

        success: bool = False
        message: str = ""
