"""std_msgs/msg/String."""

from actors.interfaces.message import Message


class String(Message, type_name="std_msgs/msg/String"):
    """std_msgs/msg/String."""

    data: str = ""
