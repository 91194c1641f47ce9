"""nav_msgs/srv/GetPlan."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose_stamped import PoseStamped
from actors.interfaces.message import Message, Service
from actors.interfaces.nav_msgs.msg._path import Path
from actors.interfaces.types import float32


class GetPlan(Service, type_name="nav_msgs/srv/GetPlan"):
    """nav_msgs/srv/GetPlan."""

    class Request(Message):
        """The request."""

        start: PoseStamped = msgspec.field(default_factory=PoseStamped)
        goal: PoseStamped = msgspec.field(default_factory=PoseStamped)
        tolerance: float32 = 0.0

    class Response(Message):
        """The response."""

        plan: Path = msgspec.field(default_factory=Path)
