"""Messages of trajectory_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.trajectory_msgs.msg._joint_trajectory import JointTrajectory
    from actors.interfaces.trajectory_msgs.msg._joint_trajectory_point import JointTrajectoryPoint
    from actors.interfaces.trajectory_msgs.msg._multi_dof_joint_trajectory import MultiDOFJointTrajectory
    from actors.interfaces.trajectory_msgs.msg._multi_dof_joint_trajectory_point import (
        MultiDOFJointTrajectoryPoint,
    )

__all__ = [
    "JointTrajectory",
    "JointTrajectoryPoint",
    "MultiDOFJointTrajectory",
    "MultiDOFJointTrajectoryPoint",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "JointTrajectory": "_joint_trajectory",
            "JointTrajectoryPoint": "_joint_trajectory_point",
            "MultiDOFJointTrajectory": "_multi_dof_joint_trajectory",
            "MultiDOFJointTrajectoryPoint": "_multi_dof_joint_trajectory_point",
        },
    )
