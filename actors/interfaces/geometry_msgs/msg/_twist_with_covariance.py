"""geometry_msgs/msg/TwistWithCovariance."""

from typing import Annotated

import msgspec

from actors.interfaces.geometry_msgs.msg._twist import Twist
from actors.interfaces.message import Message
from actors.interfaces.types import Float64Array, Float64Sequence, Length


class TwistWithCovariance(Message, type_name="geometry_msgs/msg/TwistWithCovariance"):
    """An estimated velocity with its uncertainty."""

    twist: Twist = msgspec.field(default_factory=Twist)
    """Estimated velocity, in m/s and rad/s."""
    covariance: Annotated[Float64Sequence, Length(36)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 36)
    )
    """Covariance 6x6, row-major: along x, y, z in (m/s)^2, then about x, y, z in (rad/s)^2."""
