"""type_description_interfaces/srv/GetTypeDescription."""

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.type_description_interfaces.msg._key_value import KeyValue
from actors.interfaces.type_description_interfaces.msg._type_description import TypeDescription
from actors.interfaces.type_description_interfaces.msg._type_source import TypeSource


class GetTypeDescription(Service, type_name="type_description_interfaces/srv/GetTypeDescription"):
    """type_description_interfaces/srv/GetTypeDescription."""

    class Request(Message):
        """The request."""

        type_name: str = ""
        type_hash: str = ""
        include_type_sources: bool = True

    class Response(Message):
        """The response."""

        successful: bool = False
        failure_reason: str = ""
        type_description: TypeDescription = msgspec.field(default_factory=TypeDescription)
        type_sources: list[TypeSource] = msgspec.field(default_factory=list[TypeSource])
        extra_information: list[KeyValue] = msgspec.field(default_factory=list[KeyValue])
