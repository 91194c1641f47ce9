"""std_msgs/msg/Empty."""

from actors.interfaces.message import Message


class Empty(Message, type_name="std_msgs/msg/Empty"):
    """std_msgs/msg/Empty."""
