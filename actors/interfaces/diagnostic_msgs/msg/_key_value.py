"""diagnostic_msgs/msg/KeyValue."""

from actors.interfaces.message import Message


class KeyValue(Message, type_name="diagnostic_msgs/msg/KeyValue"):
    """diagnostic_msgs/msg/KeyValue."""

    key: str = ""
    value: str = ""
