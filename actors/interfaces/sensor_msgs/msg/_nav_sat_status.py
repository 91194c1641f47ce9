"""sensor_msgs/msg/NavSatStatus."""

from typing import ClassVar

from actors.interfaces.message import Message
from actors.interfaces.types import int8, uint16


class NavSatStatus(Message, type_name="sensor_msgs/msg/NavSatStatus"):
    """How a position from satellite navigation was obtained."""

    STATUS_UNKNOWN: ClassVar[int8] = -2
    """The receiver has not told."""
    STATUS_NO_FIX: ClassVar[int8] = -1
    """The position could not be determined."""
    STATUS_FIX: ClassVar[int8] = 0
    """A position without augmentation."""
    STATUS_SBAS_FIX: ClassVar[int8] = 1
    """A position with augmentation from satellites (WAAS, EGNOS)."""
    STATUS_GBAS_FIX: ClassVar[int8] = 2
    """A position with augmentation from the ground (differential GPS, RTK)."""
    SERVICE_UNKNOWN: ClassVar[uint16] = 0
    """The systems are not known."""
    SERVICE_GPS: ClassVar[uint16] = 1
    """GPS (United States)."""
    SERVICE_GLONASS: ClassVar[uint16] = 2
    """GLONASS (Russia)."""
    SERVICE_COMPASS: ClassVar[uint16] = 4
    """BeiDou (China), formerly Compass."""
    SERVICE_GALILEO: ClassVar[uint16] = 8
    """Galileo (European Union)."""

    status: int8 = -2
    """Kind of fix: one of STATUS_*; 0 or more is a valid position."""
    service: uint16 = 0
    """Satellite systems that were used: the sum of SERVICE_* values."""
