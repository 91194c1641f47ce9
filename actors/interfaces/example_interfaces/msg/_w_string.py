"""example_interfaces/msg/WString."""

from actors.interfaces.message import Message
from actors.interfaces.types import wstring


class WString(Message, type_name="example_interfaces/msg/WString"):
    """example_interfaces/msg/WString."""

    data: wstring = ""
