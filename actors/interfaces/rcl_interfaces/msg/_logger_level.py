"""rcl_interfaces/msg/LoggerLevel."""

from typing import ClassVar

from actors.interfaces.message import Message
from actors.interfaces.types import uint8, uint32


class LoggerLevel(Message, type_name="rcl_interfaces/msg/LoggerLevel"):
    """rcl_interfaces/msg/LoggerLevel."""

    LOG_LEVEL_UNKNOWN: ClassVar[uint8] = 0
    LOG_LEVEL_DEBUG: ClassVar[uint8] = 10
    LOG_LEVEL_INFO: ClassVar[uint8] = 20
    LOG_LEVEL_WARN: ClassVar[uint8] = 30
    LOG_LEVEL_ERROR: ClassVar[uint8] = 40
    LOG_LEVEL_FATAL: ClassVar[uint8] = 50

    name: str = ""
    level: uint32 = 0
