"""std_msgs/msg/Empty."""

from actors.interfaces.message import Message


class Empty(Message, type_name="std_msgs/msg/Empty"):
    """Nothing but the fact that it was sent."""
