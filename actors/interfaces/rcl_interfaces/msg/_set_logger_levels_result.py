"""rcl_interfaces/msg/SetLoggerLevelsResult."""

from actors.interfaces.message import Message


class SetLoggerLevelsResult(Message, type_name="rcl_interfaces/msg/SetLoggerLevelsResult"):
    """rcl_interfaces/msg/SetLoggerLevelsResult."""

    successful: bool = False
    reason: str = ""
