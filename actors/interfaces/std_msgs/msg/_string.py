"""std_msgs/msg/String."""

from actors.interfaces.message import Message


class String(Message, type_name="std_msgs/msg/String"):
    """One text."""

    data: str = ""
    """Text in UTF-8."""
