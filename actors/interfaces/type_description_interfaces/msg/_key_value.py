"""type_description_interfaces/msg/KeyValue."""

from actors.interfaces.message import Message


class KeyValue(Message, type_name="type_description_interfaces/msg/KeyValue"):
    """type_description_interfaces/msg/KeyValue."""

    key: str = ""
    value: str = ""
