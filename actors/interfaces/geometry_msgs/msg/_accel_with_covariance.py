"""geometry_msgs/msg/AccelWithCovariance."""

from typing import Annotated

import msgspec

from actors.interfaces.geometry_msgs.msg._accel import Accel
from actors.interfaces.message import Message
from actors.interfaces.types import Float64Array, Float64Sequence, Length


class AccelWithCovariance(Message, type_name="geometry_msgs/msg/AccelWithCovariance"):
    """An estimated acceleration with its uncertainty."""

    accel: Accel = msgspec.field(default_factory=Accel)
    """Acceleration, in m/s^2 and rad/s^2."""
    covariance: Annotated[Float64Sequence, Length(36)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 36)
    )
    """Covariance 6x6, row-major: along x, y, z in (m/s^2)^2, then about x, y, z in (rad/s^2)^2."""
