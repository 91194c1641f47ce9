"""tf2_msgs/msg/TF2Error."""

from typing import ClassVar

from actors.interfaces.message import Message
from actors.interfaces.types import uint8


class TF2Error(Message, type_name="tf2_msgs/msg/TF2Error"):
    """The outcome of a transform lookup."""

    NO_ERROR: ClassVar[uint8] = 0
    """The transform was found."""
    LOOKUP_ERROR: ClassVar[uint8] = 1
    """A frame is not known."""
    CONNECTIVITY_ERROR: ClassVar[uint8] = 2
    """No chain of transforms connects the two frames."""
    EXTRAPOLATION_ERROR: ClassVar[uint8] = 3
    """The time is outside the times for which transforms are known."""
    INVALID_ARGUMENT_ERROR: ClassVar[uint8] = 4
    """The question was malformed, such as an empty frame name."""
    TIMEOUT_ERROR: ClassVar[uint8] = 5
    """The transform was not available before the timeout."""
    TRANSFORM_ERROR: ClassVar[uint8] = 6
    """It failed for another reason."""

    error: uint8 = 0
    """What went wrong: one of the constants."""
    error_string: str = ""
    """Human-readable explanation; empty if there was no error."""
