"""composition_interfaces/srv/LoadNode."""

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.rcl_interfaces.msg._parameter import Parameter
from actors.interfaces.types import uint8, uint64


class LoadNode(Service, type_name="composition_interfaces/srv/LoadNode"):
    """composition_interfaces/srv/LoadNode."""

    class Request(Message):
        """The request."""

        package_name: str = ""
        plugin_name: str = ""
        node_name: str = ""
        node_namespace: str = ""
        log_level: uint8 = 0
        remap_rules: list[str] = msgspec.field(default_factory=list[str])
        parameters: list[Parameter] = msgspec.field(default_factory=list[Parameter])
        extra_arguments: list[Parameter] = msgspec.field(default_factory=list[Parameter])

    class Response(Message):
        """The response."""

        success: bool = False
        error_message: str = ""
        full_node_name: str = ""
        unique_id: uint64 = 0
