"""visualization_msgs/msg/InteractiveMarker."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose import Pose
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import float32
from actors.interfaces.visualization_msgs.msg._interactive_marker_control import InteractiveMarkerControl
from actors.interfaces.visualization_msgs.msg._menu_entry import MenuEntry


class InteractiveMarker(Message, type_name="visualization_msgs/msg/InteractiveMarker"):
    """visualization_msgs/msg/InteractiveMarker."""

    header: Header = msgspec.field(default_factory=Header)
    pose: Pose = msgspec.field(default_factory=Pose)
    name: str = ""
    description: str = ""
    scale: float32 = 0.0
    menu_entries: list[MenuEntry] = msgspec.field(default_factory=list[MenuEntry])
    controls: list[InteractiveMarkerControl] = msgspec.field(default_factory=list[InteractiveMarkerControl])
