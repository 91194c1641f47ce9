"""sensor_msgs/msg/NavSatStatus."""

from typing import ClassVar

from actors.interfaces.message import Message
from actors.interfaces.types import int8, uint16


class NavSatStatus(Message, type_name="sensor_msgs/msg/NavSatStatus"):
    """sensor_msgs/msg/NavSatStatus."""

    STATUS_UNKNOWN: ClassVar[int8] = -2
    STATUS_NO_FIX: ClassVar[int8] = -1
    STATUS_FIX: ClassVar[int8] = 0
    STATUS_SBAS_FIX: ClassVar[int8] = 1
    STATUS_GBAS_FIX: ClassVar[int8] = 2
    SERVICE_UNKNOWN: ClassVar[uint16] = 0
    SERVICE_GPS: ClassVar[uint16] = 1
    SERVICE_GLONASS: ClassVar[uint16] = 2
    SERVICE_COMPASS: ClassVar[uint16] = 4
    SERVICE_GALILEO: ClassVar[uint16] = 8

    status: int8 = -2
    service: uint16 = 0
