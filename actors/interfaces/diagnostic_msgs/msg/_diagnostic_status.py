"""diagnostic_msgs/msg/DiagnosticStatus."""

from typing import ClassVar

import msgspec

from actors.interfaces.diagnostic_msgs.msg._key_value import KeyValue
from actors.interfaces.message import Message
from actors.interfaces.types import byte


class DiagnosticStatus(Message, type_name="diagnostic_msgs/msg/DiagnosticStatus"):
    """The state of one component."""

    OK: ClassVar[byte] = b"\x00"
    """The component works."""
    WARN: ClassVar[byte] = b"\x01"
    """It works, but something needs attention."""
    ERROR: ClassVar[byte] = b"\x02"
    """It does not work."""
    STALE: ClassVar[byte] = b"\x03"
    """No fresh report has arrived for it."""

    level: byte = b"\x00"
    """How well it works: OK, WARN, ERROR or STALE."""
    name: str = ""
    """Name of the component, such as "lidar: temperature"; it identifies the status."""
    message: str = ""
    """Human-readable summary of the state in one line."""
    hardware_id: str = ""
    """Name or serial number of the hardware that it is about; may be empty."""
    values: list[KeyValue] = msgspec.field(default_factory=list[KeyValue])
    """Details, as pairs of texts."""
