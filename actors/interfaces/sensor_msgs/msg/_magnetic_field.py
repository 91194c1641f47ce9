"""sensor_msgs/msg/MagneticField."""

from typing import Annotated

import msgspec

from actors.interfaces.geometry_msgs.msg._vector3 import Vector3
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Float64Array, Float64Sequence, Length


class MagneticField(Message, type_name="sensor_msgs/msg/MagneticField"):
    """One measurement of a magnetometer."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the measurement, and the frame of the sensor."""
    magnetic_field: Vector3 = msgspec.field(default_factory=Vector3)
    """Field along x, y and z of header.frame_id, in teslas; NaN for an axis without sensor."""
    magnetic_field_covariance: Annotated[Float64Sequence, Length(9)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 9)
    )
    """Covariance 3x3 in T^2, row-major; all 0 means not known."""
