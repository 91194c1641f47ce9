"""tf2_msgs/action/LookupTransform."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._duration import Duration
from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.geometry_msgs.msg._transform_stamped import TransformStamped
from actors.interfaces.message import Action, Message
from actors.interfaces.tf2_msgs.msg._tf2_error import TF2Error


class LookupTransform(Action, type_name="tf2_msgs/action/LookupTransform"):
    """Wait for a transform between two frames."""

    class Goal(Message):
        """The goal."""

        target_frame: str = ""
        """Frame to transform data into."""
        source_frame: str = ""
        """Frame that the data is in."""
        source_time: Time = msgspec.field(default_factory=Time)
        """Time of the data; 0 means the newest known transform."""
        timeout: Duration = msgspec.field(default_factory=Duration)
        """How long the server may wait until the transform is known."""
        target_time: Time = msgspec.field(default_factory=Time)
        """With advanced: the time of the target frame; ignored otherwise."""
        fixed_frame: str = ""
        """With advanced: frame that does not move between the two times; ignored otherwise."""
        advanced: bool = False
        """True if source and target have different times (target_time and fixed_frame count)."""

    class Result(Message):
        """The result."""

        transform: TransformStamped = msgspec.field(default_factory=TransformStamped)
        """Transform from source_frame to target_frame; valid if error is NO_ERROR."""
        error: TF2Error = msgspec.field(default_factory=TF2Error)
        """Whether the lookup succeeded, otherwise why not."""

    class Feedback(Message):
        """The feedback."""
