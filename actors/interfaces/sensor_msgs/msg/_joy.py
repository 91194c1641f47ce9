"""sensor_msgs/msg/Joy."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Float32Array, Float32Sequence, Int32Array, Int32Sequence


class Joy(Message, type_name="sensor_msgs/msg/Joy"):
    """The state of a joystick or gamepad."""

    header: Header = msgspec.field(default_factory=Header)
    """Time when the device was read; the frame is rarely set."""
    axes: Float32Sequence = msgspec.field(default_factory=Float32Array)
    """Position of each axis, from -1 to 1."""
    buttons: Int32Sequence = msgspec.field(default_factory=Int32Array)
    """State of each button: 1 is pressed, 0 is not."""
