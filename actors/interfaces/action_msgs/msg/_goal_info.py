"""action_msgs/msg/GoalInfo."""

import msgspec

from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.message import Message
from actors.interfaces.unique_identifier_msgs.msg._uuid import UUID


class GoalInfo(Message, type_name="action_msgs/msg/GoalInfo"):
    """action_msgs/msg/GoalInfo."""

    goal_id: UUID = msgspec.field(default_factory=UUID)
    stamp: Time = msgspec.field(default_factory=Time)
