"""composition_interfaces/srv/UnloadNode."""

from actors.interfaces.message import Message, Service
from actors.interfaces.types import uint64


class UnloadNode(Service, type_name="composition_interfaces/srv/UnloadNode"):
    """composition_interfaces/srv/UnloadNode."""

    class Request(Message):
        """The request."""

        unique_id: uint64 = 0

    class Response(Message):
        """The response."""

        success: bool = False
        error_message: str = ""
