"""diagnostic_msgs/msg/DiagnosticArray."""

import msgspec

from actors.interfaces.diagnostic_msgs.msg._diagnostic_status import DiagnosticStatus
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class DiagnosticArray(Message, type_name="diagnostic_msgs/msg/DiagnosticArray"):
    """diagnostic_msgs/msg/DiagnosticArray."""

    header: Header = msgspec.field(default_factory=Header)
    status: list[DiagnosticStatus] = msgspec.field(default_factory=list[DiagnosticStatus])
