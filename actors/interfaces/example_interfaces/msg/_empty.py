"""example_interfaces/msg/Empty."""

from actors.interfaces.message import Message


class Empty(Message, type_name="example_interfaces/msg/Empty"):
    """example_interfaces/msg/Empty."""
