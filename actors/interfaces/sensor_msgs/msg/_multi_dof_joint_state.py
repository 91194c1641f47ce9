"""sensor_msgs/msg/MultiDOFJointState."""

import msgspec

from actors.interfaces.geometry_msgs.msg._transform import Transform
from actors.interfaces.geometry_msgs.msg._twist import Twist
from actors.interfaces.geometry_msgs.msg._wrench import Wrench
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class MultiDOFJointState(Message, type_name="sensor_msgs/msg/MultiDOFJointState"):
    """sensor_msgs/msg/MultiDOFJointState."""

    header: Header = msgspec.field(default_factory=Header)
    joint_names: list[str] = msgspec.field(default_factory=list[str])
    transforms: list[Transform] = msgspec.field(default_factory=list[Transform])
    twist: list[Twist] = msgspec.field(default_factory=list[Twist])
    wrench: list[Wrench] = msgspec.field(default_factory=list[Wrench])
