"""sensor_msgs/msg/NavSatFix."""

from typing import Annotated, ClassVar

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg._nav_sat_status import NavSatStatus
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Float64Array, Float64Sequence, Length, float64, uint8


class NavSatFix(Message, type_name="sensor_msgs/msg/NavSatFix"):
    """One position from satellite navigation."""

    COVARIANCE_TYPE_UNKNOWN: ClassVar[uint8] = 0
    """The covariance is not known."""
    COVARIANCE_TYPE_APPROXIMATED: ClassVar[uint8] = 1
    """The covariance is estimated from the dilution of precision."""
    COVARIANCE_TYPE_DIAGONAL_KNOWN: ClassVar[uint8] = 2
    """The receiver gave the variances; the other elements are 0."""
    COVARIANCE_TYPE_KNOWN: ClassVar[uint8] = 3
    """The receiver gave the whole matrix."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the measurement; frame of the antenna (not of the map)."""
    status: NavSatStatus = msgspec.field(default_factory=NavSatStatus)
    """Kind of fix, and the satellite systems that were used."""
    latitude: float64 = 0.0
    """Degrees north of the equator (WGS 84); negative in the south."""
    longitude: float64 = 0.0
    """Degrees east of Greenwich (WGS 84); negative in the west."""
    altitude: float64 = 0.0
    """Metres above the WGS 84 ellipsoid (not above sea level); NaN if not known."""
    position_covariance: Annotated[Float64Sequence, Length(9)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 9)
    )
    """Covariance 3x3 in m^2, row-major, along east, north and up."""
    position_covariance_type: uint8 = 0
    """How far to trust position_covariance: one of COVARIANCE_TYPE_*."""
