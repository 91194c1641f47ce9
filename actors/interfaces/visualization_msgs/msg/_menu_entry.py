"""visualization_msgs/msg/MenuEntry."""

from typing import ClassVar

from actors.interfaces.message import Message
from actors.interfaces.types import uint8, uint32


class MenuEntry(Message, type_name="visualization_msgs/msg/MenuEntry"):
    """visualization_msgs/msg/MenuEntry."""

    FEEDBACK: ClassVar[uint8] = 0
    ROSRUN: ClassVar[uint8] = 1
    ROSLAUNCH: ClassVar[uint8] = 2

    id: uint32 = 0
    parent_id: uint32 = 0
    title: str = ""
    command: str = ""
    command_type: uint8 = 0
