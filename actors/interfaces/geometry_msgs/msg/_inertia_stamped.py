"""geometry_msgs/msg/InertiaStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._inertia import Inertia
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class InertiaStamped(Message, type_name="geometry_msgs/msg/InertiaStamped"):
    """Mass and inertia of a rigid body, with time and frame."""

    header: Header = msgspec.field(default_factory=Header)
    """Time that the inertia belongs to, and the frame in which it is expressed."""
    inertia: Inertia = msgspec.field(default_factory=Inertia)
    """Mass, centre of mass and inertia tensor in the frame of header.frame_id."""
