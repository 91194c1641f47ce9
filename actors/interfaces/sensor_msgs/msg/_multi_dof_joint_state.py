"""sensor_msgs/msg/MultiDOFJointState."""

import msgspec

from actors.interfaces.geometry_msgs.msg._transform import Transform
from actors.interfaces.geometry_msgs.msg._twist import Twist
from actors.interfaces.geometry_msgs.msg._wrench import Wrench
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class MultiDOFJointState(Message, type_name="sensor_msgs/msg/MultiDOFJointState"):
    """State of joints with several degrees of freedom."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the state, and the frame of the transforms."""
    joint_names: list[str] = msgspec.field(default_factory=list[str])
    """Names of the joints; the other lists have the same order."""
    transforms: list[Transform] = msgspec.field(default_factory=list[Transform])
    """Pose of each joint in the frame of header.frame_id, in metres; may be empty."""
    twist: list[Twist] = msgspec.field(default_factory=list[Twist])
    """Velocity of each joint, in m/s and rad/s; may be empty."""
    wrench: list[Wrench] = msgspec.field(default_factory=list[Wrench])
    """Force in N and torque in N m at each joint; may be empty."""
