"""nav_msgs/msg/TrajectoryPoint."""

import msgspec

from actors.interfaces.geometry_msgs.msg._accel import Accel
from actors.interfaces.geometry_msgs.msg._pose import Pose
from actors.interfaces.geometry_msgs.msg._twist import Twist
from actors.interfaces.geometry_msgs.msg._wrench import Wrench
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class TrajectoryPoint(Message, type_name="nav_msgs/msg/TrajectoryPoint"):
    """nav_msgs/msg/TrajectoryPoint."""

    header: Header = msgspec.field(default_factory=Header)
    pose: Pose = msgspec.field(default_factory=Pose)
    velocity: Twist = msgspec.field(default_factory=Twist)
    acceleration: Accel = msgspec.field(default_factory=Accel)
    effort: Wrench = msgspec.field(default_factory=Wrench)
