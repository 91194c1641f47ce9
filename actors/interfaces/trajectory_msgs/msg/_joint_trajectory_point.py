"""trajectory_msgs/msg/JointTrajectoryPoint."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._duration import Duration
from actors.interfaces.message import Message
from actors.interfaces.types import Float64Array, Float64Sequence


class JointTrajectoryPoint(Message, type_name="trajectory_msgs/msg/JointTrajectoryPoint"):
    """trajectory_msgs/msg/JointTrajectoryPoint."""

    positions: Float64Sequence = msgspec.field(default_factory=Float64Array)
    velocities: Float64Sequence = msgspec.field(default_factory=Float64Array)
    accelerations: Float64Sequence = msgspec.field(default_factory=Float64Array)
    effort: Float64Sequence = msgspec.field(default_factory=Float64Array)
    time_from_start: Duration = msgspec.field(default_factory=Duration)
