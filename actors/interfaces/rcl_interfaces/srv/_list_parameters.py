"""rcl_interfaces/srv/ListParameters."""

from typing import ClassVar

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.rcl_interfaces.msg._list_parameters_result import ListParametersResult
from actors.interfaces.types import uint64


class ListParameters(Service, type_name="rcl_interfaces/srv/ListParameters"):
    """rcl_interfaces/srv/ListParameters."""

    class Request(Message):
        """The request."""

        DEPTH_RECURSIVE: ClassVar[uint64] = 0

        prefixes: list[str] = msgspec.field(default_factory=list[str])
        depth: uint64 = 0

    class Response(Message):
        """The response."""

        result: ListParametersResult = msgspec.field(default_factory=ListParametersResult)
