"""example_interfaces/srv/Trigger."""

from actors.interfaces.message import Message, Service


class Trigger(Service, type_name="example_interfaces/srv/Trigger"):
    """example_interfaces/srv/Trigger."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        success: bool = False
        message: str = ""
