"""action_msgs/srv/CancelGoal."""

from typing import ClassVar

import msgspec

from actors.interfaces.action_msgs.msg._goal_info import GoalInfo
from actors.interfaces.message import Message, Service
from actors.interfaces.types import int8


class CancelGoal(Service, type_name="action_msgs/srv/CancelGoal"):
    """action_msgs/srv/CancelGoal."""

    class Request(Message):
        """The request."""

        goal_info: GoalInfo = msgspec.field(default_factory=GoalInfo)

    class Response(Message):
        """The response."""

        ERROR_NONE: ClassVar[int8] = 0
        ERROR_REJECTED: ClassVar[int8] = 1
        ERROR_UNKNOWN_GOAL_ID: ClassVar[int8] = 2
        ERROR_GOAL_TERMINATED: ClassVar[int8] = 3

        return_code: int8 = 0
        goals_canceling: list[GoalInfo] = msgspec.field(default_factory=list[GoalInfo])
