"""action_msgs/msg/GoalStatus."""

from typing import ClassVar

import msgspec

from actors.interfaces.action_msgs.msg._goal_info import GoalInfo
from actors.interfaces.message import Message
from actors.interfaces.types import int8


class GoalStatus(Message, type_name="action_msgs/msg/GoalStatus"):
    """action_msgs/msg/GoalStatus."""

    STATUS_UNKNOWN: ClassVar[int8] = 0
    STATUS_ACCEPTED: ClassVar[int8] = 1
    STATUS_EXECUTING: ClassVar[int8] = 2
    STATUS_CANCELING: ClassVar[int8] = 3
    STATUS_SUCCEEDED: ClassVar[int8] = 4
    STATUS_CANCELED: ClassVar[int8] = 5
    STATUS_ABORTED: ClassVar[int8] = 6

    goal_info: GoalInfo = msgspec.field(default_factory=GoalInfo)
    status: int8 = 0
