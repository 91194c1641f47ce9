"""example_interfaces/msg/Bool."""

from actors.interfaces.message import Message


class Bool(Message, type_name="example_interfaces/msg/Bool"):
    """example_interfaces/msg/Bool."""

    data: bool = False
