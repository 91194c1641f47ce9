"""sensor_msgs/msg/JoyFeedbackArray."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg._joy_feedback import JoyFeedback


class JoyFeedbackArray(Message, type_name="sensor_msgs/msg/JoyFeedbackArray"):
    """Several lights, rumble motors or buzzers of a gamepad to set."""

    array: list[JoyFeedback] = msgspec.field(default_factory=list[JoyFeedback])
    """Values to set, each for one light, motor or buzzer."""
