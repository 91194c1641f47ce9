"""sensor_msgs/msg/JointState."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Float64Array, Float64Sequence


class JointState(Message, type_name="sensor_msgs/msg/JointState"):
    """Positions, velocities and efforts of joints with one degree of freedom."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the state; the frame is rarely set."""
    name: list[str] = msgspec.field(default_factory=list[str])
    """Names of the joints; the other lists have the same order."""
    position: Float64Sequence = msgspec.field(default_factory=Float64Array)
    """Position of each joint, in rad (revolute) or m (prismatic); empty if not known."""
    velocity: Float64Sequence = msgspec.field(default_factory=Float64Array)
    """Velocity of each joint, in rad/s (revolute) or m/s (prismatic); empty if not known."""
    effort: Float64Sequence = msgspec.field(default_factory=Float64Array)
    """Effort of each joint, in N m (revolute) or N (prismatic); empty if not known."""
