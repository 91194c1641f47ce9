"""nav_msgs/msg/Path."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose_stamped import PoseStamped
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header


class Path(Message, type_name="nav_msgs/msg/Path"):
    """A way as a list of poses."""

    header: Header = msgspec.field(default_factory=Header)
    """Time when the path was made, and the frame that it lies in."""
    poses: list[PoseStamped] = msgspec.field(default_factory=list[PoseStamped])
    """Poses along the path, from its start to its end."""
