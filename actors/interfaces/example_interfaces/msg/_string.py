"""example_interfaces/msg/String."""

from actors.interfaces.message import Message


class String(Message, type_name="example_interfaces/msg/String"):
    """example_interfaces/msg/String."""

    data: str = ""
