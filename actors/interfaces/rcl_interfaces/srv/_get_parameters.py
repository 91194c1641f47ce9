"""rcl_interfaces/srv/GetParameters."""

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.rcl_interfaces.msg._parameter_value import ParameterValue


class GetParameters(Service, type_name="rcl_interfaces/srv/GetParameters"):
    """rcl_interfaces/srv/GetParameters."""

    class Request(Message):
        """The request."""

        names: list[str] = msgspec.field(default_factory=list[str])

    class Response(Message):
        """The response."""

        values: list[ParameterValue] = msgspec.field(default_factory=list[ParameterValue])
