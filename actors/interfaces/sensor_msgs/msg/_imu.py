"""sensor_msgs/msg/Imu."""

from typing import Annotated

import msgspec

from actors.interfaces.geometry_msgs.msg._quaternion import Quaternion
from actors.interfaces.geometry_msgs.msg._vector3 import Vector3
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Float64Array, Float64Sequence, Length


class Imu(Message, type_name="sensor_msgs/msg/Imu"):
    """One measurement of an inertial measurement unit."""

    header: Header = msgspec.field(default_factory=Header)
    """Time of the measurement, and the frame of the sensor."""
    orientation: Quaternion = msgspec.field(default_factory=Quaternion)
    """Orientation of the sensor's frame in a fixed frame (x east, y north, z up)."""
    orientation_covariance: Annotated[Float64Sequence, Length(9)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 9)
    )
    """3x3 about x, y, z in rad^2, row-major; all 0: not known; first -1: no orientation."""
    angular_velocity: Vector3 = msgspec.field(default_factory=Vector3)
    """Angular velocity about x, y and z of header.frame_id, in rad/s."""
    angular_velocity_covariance: Annotated[Float64Sequence, Length(9)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 9)
    )
    """3x3 in (rad/s)^2, row-major; all 0: not known; first -1: not measured."""
    linear_acceleration: Vector3 = msgspec.field(default_factory=Vector3)
    """Acceleration along x, y and z of header.frame_id, in m/s^2, usually with gravity."""
    linear_acceleration_covariance: Annotated[Float64Sequence, Length(9)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 9)
    )
    """3x3 in (m/s^2)^2, row-major; all 0: not known; first -1: not measured."""
