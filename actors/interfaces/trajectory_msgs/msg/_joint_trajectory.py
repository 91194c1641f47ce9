"""trajectory_msgs/msg/JointTrajectory."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.trajectory_msgs.msg._joint_trajectory_point import JointTrajectoryPoint


class JointTrajectory(Message, type_name="trajectory_msgs/msg/JointTrajectory"):
    """trajectory_msgs/msg/JointTrajectory."""

    header: Header = msgspec.field(default_factory=Header)
    joint_names: list[str] = msgspec.field(default_factory=list[str])
    points: list[JointTrajectoryPoint] = msgspec.field(default_factory=list[JointTrajectoryPoint])
