"""lifecycle_msgs/msg/TransitionEvent."""

import msgspec

from actors.interfaces.lifecycle_msgs.msg._state import State
from actors.interfaces.lifecycle_msgs.msg._transition import Transition
from actors.interfaces.message import Message
from actors.interfaces.types import uint64


class TransitionEvent(Message, type_name="lifecycle_msgs/msg/TransitionEvent"):
    """lifecycle_msgs/msg/TransitionEvent."""

    timestamp: uint64 = 0
    transition: Transition = msgspec.field(default_factory=Transition)
    start_state: State = msgspec.field(default_factory=State)
    goal_state: State = msgspec.field(default_factory=State)
