"""tf2_msgs/action/LookupTransform."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._duration import Duration
from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.geometry_msgs.msg._transform_stamped import TransformStamped
from actors.interfaces.message import Action, Message
from actors.interfaces.tf2_msgs.msg._tf2_error import TF2Error


class LookupTransform(Action, type_name="tf2_msgs/action/LookupTransform"):
    """tf2_msgs/action/LookupTransform."""

    class Goal(Message):
        """The goal."""

        target_frame: str = ""
        source_frame: str = ""
        source_time: Time = msgspec.field(default_factory=Time)
        timeout: Duration = msgspec.field(default_factory=Duration)
        target_time: Time = msgspec.field(default_factory=Time)
        fixed_frame: str = ""
        advanced: bool = False

    class Result(Message):
        """The result."""

        transform: TransformStamped = msgspec.field(default_factory=TransformStamped)
        error: TF2Error = msgspec.field(default_factory=TF2Error)

    class Feedback(Message):
        """The feedback."""
