"""rcl_interfaces/srv/GetLoggerLevels."""

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.rcl_interfaces.msg._logger_level import LoggerLevel


class GetLoggerLevels(Service, type_name="rcl_interfaces/srv/GetLoggerLevels"):
    """rcl_interfaces/srv/GetLoggerLevels."""

    class Request(Message):
        """The request."""

        names: list[str] = msgspec.field(default_factory=list[str])

    class Response(Message):
        """The response."""

        levels: list[LoggerLevel] = msgspec.field(default_factory=list[LoggerLevel])
