"""example_interfaces/srv/SetBool."""

from actors.interfaces.message import Message, Service


class SetBool(Service, type_name="example_interfaces/srv/SetBool"):
    """example_interfaces/srv/SetBool."""

    class Request(Message):
        """The request."""

        data: bool = False

    class Response(Message):
        """The response."""

        success: bool = False
        message: str = ""
