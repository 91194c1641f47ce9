"""composition_interfaces/srv/ListNodes."""

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.types import UInt64Array, UInt64Sequence


class ListNodes(Service, type_name="composition_interfaces/srv/ListNodes"):
    """composition_interfaces/srv/ListNodes."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        full_node_names: list[str] = msgspec.field(default_factory=list[str])
        unique_ids: UInt64Sequence = msgspec.field(default_factory=UInt64Array)
