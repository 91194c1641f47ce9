"""geometry_msgs/msg/InertiaStamped."""

import msgspec

from actors.interfaces.geometry_msgs.msg._inertia import Inertia
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class InertiaStamped(Message, type_name="geometry_msgs/msg/InertiaStamped"):
    """geometry_msgs/msg/InertiaStamped."""

    header: Header = msgspec.field(default_factory=Header)
    inertia: Inertia = msgspec.field(default_factory=Inertia)
