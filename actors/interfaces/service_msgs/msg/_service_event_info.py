"""service_msgs/msg/ServiceEventInfo."""

from typing import Annotated, ClassVar

import msgspec

from actors.interfaces.builtin_interfaces.msg._time import Time
from actors.interfaces.message import Message
from actors.interfaces.types import CharSequence, Length, int64, uint8


class ServiceEventInfo(Message, type_name="service_msgs/msg/ServiceEventInfo"):
    """service_msgs/msg/ServiceEventInfo."""

    REQUEST_SENT: ClassVar[uint8] = 0
    REQUEST_RECEIVED: ClassVar[uint8] = 1
    RESPONSE_SENT: ClassVar[uint8] = 2
    RESPONSE_RECEIVED: ClassVar[uint8] = 3

    event_type: uint8 = 0
    stamp: Time = msgspec.field(default_factory=Time)
    client_gid: Annotated[CharSequence, Length(16)] = bytes(16)
    sequence_number: int64 = 0
