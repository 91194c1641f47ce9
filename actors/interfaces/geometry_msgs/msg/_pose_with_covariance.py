"""geometry_msgs/msg/PoseWithCovariance."""

from typing import Annotated

import msgspec

from actors.interfaces.geometry_msgs.msg._pose import Pose
from actors.interfaces.message import Message
from actors.interfaces.types import Float64Array, Float64Sequence, Length


class PoseWithCovariance(Message, type_name="geometry_msgs/msg/PoseWithCovariance"):
    """An estimated pose with its uncertainty."""

    pose: Pose = msgspec.field(default_factory=Pose)
    """Estimated position in metres and orientation."""
    covariance: Annotated[Float64Sequence, Length(36)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 36)
    )
    """Covariance 6x6, row-major: x, y, z in m^2, then rotations about fixed x, y, z in rad^2."""
