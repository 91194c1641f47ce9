"""rcl_interfaces/srv/SetParametersAtomically."""

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.rcl_interfaces.msg._parameter import Parameter
from actors.interfaces.rcl_interfaces.msg._set_parameters_result import SetParametersResult


class SetParametersAtomically(Service, type_name="rcl_interfaces/srv/SetParametersAtomically"):
    """rcl_interfaces/srv/SetParametersAtomically."""

    class Request(Message):
        """The request."""

        parameters: list[Parameter] = msgspec.field(default_factory=list[Parameter])

    class Response(Message):
        """The response."""

        result: SetParametersResult = msgspec.field(default_factory=SetParametersResult)
