"""std_msgs/msg/Bool."""

from actors.interfaces.message import Message


class Bool(Message, type_name="std_msgs/msg/Bool"):
    """std_msgs/msg/Bool."""

    data: bool = False
