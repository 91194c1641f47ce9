"""rcl_interfaces/msg/ListParametersResult."""

import msgspec

from actors.interfaces.message import Message


class ListParametersResult(Message, type_name="rcl_interfaces/msg/ListParametersResult"):
    """rcl_interfaces/msg/ListParametersResult."""

    names: list[str] = msgspec.field(default_factory=list[str])
    prefixes: list[str] = msgspec.field(default_factory=list[str])
