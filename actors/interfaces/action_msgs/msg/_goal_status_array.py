"""action_msgs/msg/GoalStatusArray."""

import msgspec

from actors.interfaces.action_msgs.msg._goal_status import GoalStatus
from actors.interfaces.message import Message


class GoalStatusArray(Message, type_name="action_msgs/msg/GoalStatusArray"):
    """action_msgs/msg/GoalStatusArray."""

    status_list: list[GoalStatus] = msgspec.field(default_factory=list[GoalStatus])
