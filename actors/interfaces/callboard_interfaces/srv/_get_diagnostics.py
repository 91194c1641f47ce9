"""callboard_interfaces/srv/GetDiagnostics."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.callboard_interfaces.msg._callback_times import CallbackTimes
from actors.interfaces.message import Message, Service
from actors.interfaces.types import float64, uint32, uint64


class GetDiagnostics(Service, type_name="callboard_interfaces/srv/GetDiagnostics"):
    """callboard_interfaces/srv/GetDiagnostics."""

    class Request(Message):
        """The request."""

    class Response(Message):
        """The response."""

        host: str = ""
        pid: uint32 = 0
        stamp: Time = msgspec.field(default_factory=Time)
        uptime_sec: float64 = 0.0
        connections: uint32 = 0
        callback_errors: uint64 = 0
        loop_lag_sec: float64 = 0.0
        longest_loop_lag_sec: float64 = 0.0
        callbacks: list[CallbackTimes] = msgspec.field(default_factory=list[CallbackTimes])
        omitted_callbacks: uint32 = 0
