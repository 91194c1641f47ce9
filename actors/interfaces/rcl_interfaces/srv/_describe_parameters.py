"""rcl_interfaces/srv/DescribeParameters."""

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.rcl_interfaces.msg._parameter_descriptor import ParameterDescriptor


class DescribeParameters(Service, type_name="rcl_interfaces/srv/DescribeParameters"):
    """rcl_interfaces/srv/DescribeParameters."""

    class Request(Message):
        """The request."""

        names: list[str] = msgspec.field(default_factory=list[str])

    class Response(Message):
        """The response."""

        descriptors: list[ParameterDescriptor] = msgspec.field(default_factory=list[ParameterDescriptor])
