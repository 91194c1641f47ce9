"""rcl_interfaces/msg/Log."""

from typing import ClassVar

import msgspec

from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.message import Message
from actors.interfaces.types import uint8, uint32


class Log(Message, type_name="rcl_interfaces/msg/Log"):
    """rcl_interfaces/msg/Log."""

    DEBUG: ClassVar[uint8] = 10
    INFO: ClassVar[uint8] = 20
    WARN: ClassVar[uint8] = 30
    ERROR: ClassVar[uint8] = 40
    FATAL: ClassVar[uint8] = 50

    stamp: Time = msgspec.field(default_factory=Time)
    level: uint8 = 0
    name: str = ""
    msg: str = ""
    file: str = ""
    function: str = ""
    line: uint32 = 0
