"""diagnostic_msgs/msg/DiagnosticStatus."""

from typing import ClassVar

import msgspec

from actors.interfaces.diagnostic_msgs.msg._key_value import KeyValue
from actors.interfaces.message import Message
from actors.interfaces.types import byte


class DiagnosticStatus(Message, type_name="diagnostic_msgs/msg/DiagnosticStatus"):
    """diagnostic_msgs/msg/DiagnosticStatus."""

    OK: ClassVar[byte] = b"\x00"
    WARN: ClassVar[byte] = b"\x01"
    ERROR: ClassVar[byte] = b"\x02"
    STALE: ClassVar[byte] = b"\x03"

    level: byte = b"\x00"
    name: str = ""
    message: str = ""
    hardware_id: str = ""
    values: list[KeyValue] = msgspec.field(default_factory=list[KeyValue])
