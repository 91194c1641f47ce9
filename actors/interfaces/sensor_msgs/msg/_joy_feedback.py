"""sensor_msgs/msg/JoyFeedback."""

from typing import ClassVar

from actors.interfaces.message import Message
from actors.interfaces.types import float32, uint8


class JoyFeedback(Message, type_name="sensor_msgs/msg/JoyFeedback"):
    """A light, rumble motor or buzzer of a gamepad to set."""

    TYPE_LED: ClassVar[uint8] = 0
    """A light."""
    TYPE_RUMBLE: ClassVar[uint8] = 1
    """A motor that shakes the device."""
    TYPE_BUZZER: ClassVar[uint8] = 2
    """A buzzer."""

    type: uint8 = 0
    """What to drive: one of TYPE_*."""
    id: uint8 = 0
    """Which one of this type, counted from 0."""
    intensity: float32 = 0.0
    """Strength from 0 (off) to 1 (full)."""
