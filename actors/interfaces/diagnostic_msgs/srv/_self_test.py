"""diagnostic_msgs/srv/SelfTest."""

import msgspec

from actors.interfaces.diagnostic_msgs.msg._diagnostic_status import DiagnosticStatus
from actors.interfaces.message import Message, Service
from actors.interfaces.types import byte


class SelfTest(Service, type_name="diagnostic_msgs/srv/SelfTest"):
    """Let a device test itself."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        id: str = ""
        """Name or serial number of the tested hardware."""
        passed: byte = b"\x00"
        """1 if every test passed, otherwise 0."""
        status: list[DiagnosticStatus] = msgspec.field(default_factory=list[DiagnosticStatus])
        """Result of each test."""
