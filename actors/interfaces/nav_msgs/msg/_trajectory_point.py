"""nav_msgs/msg/TrajectoryPoint."""

import msgspec

from actors.interfaces.geometry_msgs.msg._accel import Accel
from actors.interfaces.geometry_msgs.msg._pose import Pose
from actors.interfaces.geometry_msgs.msg._twist import Twist
from actors.interfaces.geometry_msgs.msg._wrench import Wrench
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class TrajectoryPoint(Message, type_name="nav_msgs/msg/TrajectoryPoint"):
    """Pose, velocity, acceleration and effort at one moment of a motion."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of this point, and the frame of its pose."""
    pose: Pose = msgspec.field(default_factory=Pose)
    """Pose in the frame of header.frame_id, in metres."""
    velocity: Twist = msgspec.field(default_factory=Twist)
    """Velocity at this point, in m/s and rad/s."""
    acceleration: Accel = msgspec.field(default_factory=Accel)
    """Acceleration at this point, in m/s^2 and rad/s^2."""
    effort: Wrench = msgspec.field(default_factory=Wrench)
    """Force in newtons and torque in newton metres at this point."""
