"""lifecycle_msgs/msg/TransitionDescription."""

import msgspec

from actors.interfaces.lifecycle_msgs.msg._state import State
from actors.interfaces.lifecycle_msgs.msg._transition import Transition
from actors.interfaces.message import Message


class TransitionDescription(Message, type_name="lifecycle_msgs/msg/TransitionDescription"):
    """lifecycle_msgs/msg/TransitionDescription."""

    transition: Transition = msgspec.field(default_factory=Transition)
    start_state: State = msgspec.field(default_factory=State)
    goal_state: State = msgspec.field(default_factory=State)
