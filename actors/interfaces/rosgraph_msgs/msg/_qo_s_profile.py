"""rosgraph_msgs/msg/QoSProfile."""

from typing import ClassVar

import msgspec

from actors.interfaces.builtin_interfaces.msg._duration import Duration
from actors.interfaces.message import Message
from actors.interfaces.types import uint8, uint32


class QoSProfile(Message, type_name="rosgraph_msgs/msg/QoSProfile"):
    """rosgraph_msgs/msg/QoSProfile."""

    HISTORY_SYSTEM_DEFAULT: ClassVar[uint8] = 0
    HISTORY_KEEP_LAST: ClassVar[uint8] = 1
    HISTORY_KEEP_ALL: ClassVar[uint8] = 2
    HISTORY_UNKNOWN: ClassVar[uint8] = 3
    RELIABILITY_SYSTEM_DEFAULT: ClassVar[uint8] = 0
    RELIABILITY_RELIABLE: ClassVar[uint8] = 1
    RELIABILITY_BEST_EFFORT: ClassVar[uint8] = 2
    RELIABILITY_UNKNOWN: ClassVar[uint8] = 3
    RELIABILITY_BEST_AVAILABLE: ClassVar[uint8] = 4
    DURABILITY_SYSTEM_DEFAULT: ClassVar[uint8] = 0
    DURABILITY_TRANSIENT_LOCAL: ClassVar[uint8] = 1
    DURABILITY_VOLATILE: ClassVar[uint8] = 2
    DURABILITY_UNKNOWN: ClassVar[uint8] = 3
    DURABILITY_BEST_AVAILABLE: ClassVar[uint8] = 4
    LIVELINESS_SYSTEM_DEFAULT: ClassVar[uint8] = 0
    LIVELINESS_AUTOMATIC: ClassVar[uint8] = 1
    LIVELINESS_MANUAL_BY_TOPIC: ClassVar[uint8] = 3
    LIVELINESS_UNKNOWN: ClassVar[uint8] = 4
    LIVELINESS_BEST_AVAILABLE: ClassVar[uint8] = 5

    depth: uint32 = 0
    deadline: Duration = msgspec.field(default_factory=Duration)
    lifespan: Duration = msgspec.field(default_factory=Duration)
    history: uint8 = 0
    reliability: uint8 = 0
    durability: uint8 = 0
    liveliness: uint8 = 0
    liveliness_lease_duration: Duration = msgspec.field(default_factory=Duration)
