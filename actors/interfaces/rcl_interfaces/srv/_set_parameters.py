"""rcl_interfaces/srv/SetParameters."""

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.rcl_interfaces.msg._parameter import Parameter
from actors.interfaces.rcl_interfaces.msg._set_parameters_result import SetParametersResult


class SetParameters(Service, type_name="rcl_interfaces/srv/SetParameters"):
    """rcl_interfaces/srv/SetParameters."""

    class Request(Message):
        """The request."""

        parameters: list[Parameter] = msgspec.field(default_factory=list[Parameter])

    class Response(Message):
        """The response."""

        results: list[SetParametersResult] = msgspec.field(default_factory=list[SetParametersResult])
