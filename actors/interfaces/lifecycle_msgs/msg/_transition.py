"""lifecycle_msgs/msg/Transition."""

from typing import ClassVar

from actors.interfaces.message import Message
from actors.interfaces.types import uint8


class Transition(Message, type_name="lifecycle_msgs/msg/Transition"):
    """lifecycle_msgs/msg/Transition."""

    TRANSITION_CREATE: ClassVar[uint8] = 0
    TRANSITION_CONFIGURE: ClassVar[uint8] = 1
    TRANSITION_CLEANUP: ClassVar[uint8] = 2
    TRANSITION_ACTIVATE: ClassVar[uint8] = 3
    TRANSITION_DEACTIVATE: ClassVar[uint8] = 4
    TRANSITION_UNCONFIGURED_SHUTDOWN: ClassVar[uint8] = 5
    TRANSITION_INACTIVE_SHUTDOWN: ClassVar[uint8] = 6
    TRANSITION_ACTIVE_SHUTDOWN: ClassVar[uint8] = 7
    TRANSITION_DESTROY: ClassVar[uint8] = 8
    TRANSITION_ON_CONFIGURE_SUCCESS: ClassVar[uint8] = 10
    TRANSITION_ON_CONFIGURE_FAILURE: ClassVar[uint8] = 11
    TRANSITION_ON_CONFIGURE_ERROR: ClassVar[uint8] = 12
    TRANSITION_ON_CLEANUP_SUCCESS: ClassVar[uint8] = 20
    TRANSITION_ON_CLEANUP_FAILURE: ClassVar[uint8] = 21
    TRANSITION_ON_CLEANUP_ERROR: ClassVar[uint8] = 22
    TRANSITION_ON_ACTIVATE_SUCCESS: ClassVar[uint8] = 30
    TRANSITION_ON_ACTIVATE_FAILURE: ClassVar[uint8] = 31
    TRANSITION_ON_ACTIVATE_ERROR: ClassVar[uint8] = 32
    TRANSITION_ON_DEACTIVATE_SUCCESS: ClassVar[uint8] = 40
    TRANSITION_ON_DEACTIVATE_FAILURE: ClassVar[uint8] = 41
    TRANSITION_ON_DEACTIVATE_ERROR: ClassVar[uint8] = 42
    TRANSITION_ON_SHUTDOWN_SUCCESS: ClassVar[uint8] = 50
    TRANSITION_ON_SHUTDOWN_FAILURE: ClassVar[uint8] = 51
    TRANSITION_ON_SHUTDOWN_ERROR: ClassVar[uint8] = 52
    TRANSITION_ON_ERROR_SUCCESS: ClassVar[uint8] = 60
    TRANSITION_ON_ERROR_FAILURE: ClassVar[uint8] = 61
    TRANSITION_ON_ERROR_ERROR: ClassVar[uint8] = 62
    TRANSITION_CALLBACK_SUCCESS: ClassVar[uint8] = 97
    TRANSITION_CALLBACK_FAILURE: ClassVar[uint8] = 98
    TRANSITION_CALLBACK_ERROR: ClassVar[uint8] = 99

    id: uint8 = 0
    label: str = ""
