"""rcl_interfaces/srv/SetLoggerLevels."""

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.rcl_interfaces.msg._logger_level import LoggerLevel
from actors.interfaces.rcl_interfaces.msg._set_logger_levels_result import SetLoggerLevelsResult


class SetLoggerLevels(Service, type_name="rcl_interfaces/srv/SetLoggerLevels"):
    """rcl_interfaces/srv/SetLoggerLevels."""

    class Request(Message):
        """The request."""

        levels: list[LoggerLevel] = msgspec.field(default_factory=list[LoggerLevel])

    class Response(Message):
        """The response."""

        results: list[SetLoggerLevelsResult] = msgspec.field(default_factory=list[SetLoggerLevelsResult])
