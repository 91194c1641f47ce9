"""geometry_msgs/msg/AccelWithCovariance."""

from typing import Annotated

import msgspec

from actors.interfaces.geometry_msgs.msg._accel import Accel
from actors.interfaces.message import Message
from actors.interfaces.types import Float64Array, Float64Sequence, Length


class AccelWithCovariance(Message, type_name="geometry_msgs/msg/AccelWithCovariance"):
    """geometry_msgs/msg/AccelWithCovariance."""

    accel: Accel = msgspec.field(default_factory=Accel)
    covariance: Annotated[Float64Sequence, Length(36)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 36)
    )
