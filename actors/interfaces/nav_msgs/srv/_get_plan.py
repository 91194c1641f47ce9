"""nav_msgs/srv/GetPlan."""

import msgspec

from actors.interfaces.geometry_msgs.msg._pose_stamped import PoseStamped
from actors.interfaces.message import Message, Service
from actors.interfaces.nav_msgs.msg._path import Path
from actors.interfaces.types import float32


class GetPlan(Service, type_name="nav_msgs/srv/GetPlan"):
    """Ask for a way from one pose to another."""

    class Request(Message):
        """The request."""

        start: PoseStamped = msgspec.field(default_factory=PoseStamped)
        """Pose where the plan starts."""
        goal: PoseStamped = msgspec.field(default_factory=PoseStamped)
        """Pose where the plan ends."""
        tolerance: float32 = 0.0
        """If the goal cannot be reached: distance from it at which the plan may end, in metres."""

    class Response(Message):
        """The response."""

        plan: Path = msgspec.field(default_factory=Path)
        """Poses from the start to the goal; empty if there is no way."""
