"""diagnostic_msgs/msg/DiagnosticArray."""

import msgspec

from actors.interfaces.diagnostic_msgs.msg._diagnostic_status import DiagnosticStatus
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class DiagnosticArray(Message, type_name="diagnostic_msgs/msg/DiagnosticArray"):
    """States of components, as on /diagnostics."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the report; its frame has no meaning."""
    status: list[DiagnosticStatus] = msgspec.field(default_factory=list[DiagnosticStatus])
    """State of one or more components."""
