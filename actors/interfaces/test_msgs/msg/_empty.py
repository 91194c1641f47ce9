"""test_msgs/msg/Empty."""

from actors.interfaces.message import Message


class Empty(Message, type_name="test_msgs/msg/Empty"):
    """test_msgs/msg/Empty."""
