"""std_msgs/msg/Bool."""

from actors.interfaces.message import Message


class Bool(Message, type_name="std_msgs/msg/Bool"):
    """One truth value."""

    data: bool = False
    """True or False."""
