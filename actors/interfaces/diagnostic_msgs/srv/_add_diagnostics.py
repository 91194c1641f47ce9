"""diagnostic_msgs/srv/AddDiagnostics."""

from actors.interfaces.message import Message, Service


class AddDiagnostics(Service, type_name="diagnostic_msgs/srv/AddDiagnostics"):
    """diagnostic_msgs/srv/AddDiagnostics."""

    class Request(Message):
        """The request."""

        load_namespace: str = ""

    class Response(Message):
        """The response."""

        success: bool = False
        message: str = ""
