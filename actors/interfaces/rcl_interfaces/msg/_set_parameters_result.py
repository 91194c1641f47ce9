"""rcl_interfaces/msg/SetParametersResult."""

from actors.interfaces.message import Message


class SetParametersResult(Message, type_name="rcl_interfaces/msg/SetParametersResult"):
    """rcl_interfaces/msg/SetParametersResult."""

    successful: bool = False
    reason: str = ""
