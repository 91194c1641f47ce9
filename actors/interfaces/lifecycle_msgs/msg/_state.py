"""lifecycle_msgs/msg/State."""

from typing import ClassVar

from actors.interfaces.message import Message
from actors.interfaces.types import uint8


class State(Message, type_name="lifecycle_msgs/msg/State"):
    """lifecycle_msgs/msg/State."""

    PRIMARY_STATE_UNKNOWN: ClassVar[uint8] = 0
    PRIMARY_STATE_UNCONFIGURED: ClassVar[uint8] = 1
    PRIMARY_STATE_INACTIVE: ClassVar[uint8] = 2
    PRIMARY_STATE_ACTIVE: ClassVar[uint8] = 3
    PRIMARY_STATE_FINALIZED: ClassVar[uint8] = 4
    TRANSITION_STATE_CONFIGURING: ClassVar[uint8] = 10
    TRANSITION_STATE_CLEANINGUP: ClassVar[uint8] = 11
    TRANSITION_STATE_SHUTTINGDOWN: ClassVar[uint8] = 12
    TRANSITION_STATE_ACTIVATING: ClassVar[uint8] = 13
    TRANSITION_STATE_DEACTIVATING: ClassVar[uint8] = 14
    TRANSITION_STATE_ERRORPROCESSING: ClassVar[uint8] = 15

    id: uint8 = 0
    label: str = ""
