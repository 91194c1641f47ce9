"""sensor_msgs/msg/NavSatFix."""

from typing import Annotated, ClassVar

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg._nav_sat_status import NavSatStatus
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Float64Array, Float64Sequence, Length, float64, uint8


class NavSatFix(Message, type_name="sensor_msgs/msg/NavSatFix"):
    """sensor_msgs/msg/NavSatFix."""

    COVARIANCE_TYPE_UNKNOWN: ClassVar[uint8] = 0
    COVARIANCE_TYPE_APPROXIMATED: ClassVar[uint8] = 1
    COVARIANCE_TYPE_DIAGONAL_KNOWN: ClassVar[uint8] = 2
    COVARIANCE_TYPE_KNOWN: ClassVar[uint8] = 3

    header: Header = msgspec.field(default_factory=Header)
    status: NavSatStatus = msgspec.field(default_factory=NavSatStatus)
    latitude: float64 = 0.0
    longitude: float64 = 0.0
    altitude: float64 = 0.0
    position_covariance: Annotated[Float64Sequence, Length(9)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 9)
    )
    position_covariance_type: uint8 = 0
