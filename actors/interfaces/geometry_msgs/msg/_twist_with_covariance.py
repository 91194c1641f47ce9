"""geometry_msgs/msg/TwistWithCovariance."""

from typing import Annotated

import msgspec

from actors.interfaces.geometry_msgs.msg._twist import Twist
from actors.interfaces.message import Message
from actors.interfaces.types import Float64Array, Float64Sequence, Length


class TwistWithCovariance(Message, type_name="geometry_msgs/msg/TwistWithCovariance"):
    """geometry_msgs/msg/TwistWithCovariance."""

    twist: Twist = msgspec.field(default_factory=Twist)
    covariance: Annotated[Float64Sequence, Length(36)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 36)
    )
