"""rcl_interfaces/srv/GetParameterTypes."""

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.types import UInt8Sequence


class GetParameterTypes(Service, type_name="rcl_interfaces/srv/GetParameterTypes"):
    """rcl_interfaces/srv/GetParameterTypes."""

    class Request(Message):
        """The request."""

        names: list[str] = msgspec.field(default_factory=list[str])

    class Response(Message):
        """The response."""

        types: UInt8Sequence = b""
