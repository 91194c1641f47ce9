"""sensor_msgs/msg/JoyFeedback."""

from typing import ClassVar

from actors.interfaces.message import Message
from actors.interfaces.types import float32, uint8


class JoyFeedback(Message, type_name="sensor_msgs/msg/JoyFeedback"):
    """sensor_msgs/msg/JoyFeedback."""

    TYPE_LED: ClassVar[uint8] = 0
    TYPE_RUMBLE: ClassVar[uint8] = 1
    TYPE_BUZZER: ClassVar[uint8] = 2

    type: uint8 = 0
    id: uint8 = 0
    intensity: float32 = 0.0
