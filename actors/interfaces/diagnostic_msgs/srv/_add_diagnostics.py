"""diagnostic_msgs/srv/AddDiagnostics."""

from actors.interfaces.message import Message, Service


class AddDiagnostics(Service, type_name="diagnostic_msgs/srv/AddDiagnostics"):
    """Add analyzers to a running aggregator of diagnostics."""

    class Request(Message):
        """The request."""

        load_namespace: str = ""
        """Namespace of the parameters that describe the analyzers to add."""

    class Response(Message):
        """The response."""

        success: bool = False
        """True if the aggregator has added them."""
        message: str = ""
        """Why not, if success is False."""
