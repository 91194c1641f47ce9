"""diagnostic_msgs/msg/KeyValue."""

from actors.interfaces.message import Message


class KeyValue(Message, type_name="diagnostic_msgs/msg/KeyValue"):
    """A named value as text."""

    key: str = ""
    """What the value is, with its unit where there is one."""
    value: str = ""
    """The value, as text."""
