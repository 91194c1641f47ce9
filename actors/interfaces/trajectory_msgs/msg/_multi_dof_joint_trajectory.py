"""trajectory_msgs/msg/MultiDOFJointTrajectory."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.trajectory_msgs.msg._multi_dof_joint_trajectory_point import (
    MultiDOFJointTrajectoryPoint,
)


class MultiDOFJointTrajectory(Message, type_name="trajectory_msgs/msg/MultiDOFJointTrajectory"):
    """trajectory_msgs/msg/MultiDOFJointTrajectory."""

    header: Header = msgspec.field(default_factory=Header)
    joint_names: list[str] = msgspec.field(default_factory=list[str])
    points: list[MultiDOFJointTrajectoryPoint] = msgspec.field(
        default_factory=list[MultiDOFJointTrajectoryPoint]
    )
