"""trajectory_msgs/msg/MultiDOFJointTrajectoryPoint."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._duration import Duration
from actors.interfaces.geometry_msgs.msg._transform import Transform
from actors.interfaces.geometry_msgs.msg._twist import Twist
from actors.interfaces.message import Message


class MultiDOFJointTrajectoryPoint(Message, type_name="trajectory_msgs/msg/MultiDOFJointTrajectoryPoint"):
    """trajectory_msgs/msg/MultiDOFJointTrajectoryPoint."""

    transforms: list[Transform] = msgspec.field(default_factory=list[Transform])
    velocities: list[Twist] = msgspec.field(default_factory=list[Twist])
    accelerations: list[Twist] = msgspec.field(default_factory=list[Twist])
    time_from_start: Duration = msgspec.field(default_factory=Duration)
