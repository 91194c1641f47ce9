"""diagnostic_msgs/srv/SelfTest."""

import msgspec

from actors.interfaces.diagnostic_msgs.msg._diagnostic_status import DiagnosticStatus
from actors.interfaces.message import Message, Service
from actors.interfaces.types import byte


class SelfTest(Service, type_name="diagnostic_msgs/srv/SelfTest"):
    """diagnostic_msgs/srv/SelfTest."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        id: str = ""
        passed: byte = b"\x00"
        status: list[DiagnosticStatus] = msgspec.field(default_factory=list[DiagnosticStatus])
