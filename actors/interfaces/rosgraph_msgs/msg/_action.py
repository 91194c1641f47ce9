"""rosgraph_msgs/msg/Action."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.rosgraph_msgs.msg._service import Service as RosgraphMsgsService
from actors.interfaces.rosgraph_msgs.msg._topic import Topic


class Action(Message, type_name="rosgraph_msgs/msg/Action"):
    """rosgraph_msgs/msg/Action."""

    name: str = ""
    send_goal: RosgraphMsgsService = msgspec.field(default_factory=RosgraphMsgsService)
    get_result: RosgraphMsgsService = msgspec.field(default_factory=RosgraphMsgsService)
    cancel_goal: RosgraphMsgsService = msgspec.field(default_factory=RosgraphMsgsService)
    feedback: Topic = msgspec.field(default_factory=Topic)
    status: Topic = msgspec.field(default_factory=Topic)
