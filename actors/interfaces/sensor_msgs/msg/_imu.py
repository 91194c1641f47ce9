"""sensor_msgs/msg/Imu."""

from typing import Annotated

import msgspec

from actors.interfaces.geometry_msgs.msg._quaternion import Quaternion
from actors.interfaces.geometry_msgs.msg._vector3 import Vector3
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Float64Array, Float64Sequence, Length


class Imu(Message, type_name="sensor_msgs/msg/Imu"):
    """sensor_msgs/msg/Imu."""

    header: Header = msgspec.field(default_factory=Header)
    orientation: Quaternion = msgspec.field(default_factory=Quaternion)
    orientation_covariance: Annotated[Float64Sequence, Length(9)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 9)
    )
    angular_velocity: Vector3 = msgspec.field(default_factory=Vector3)
    angular_velocity_covariance: Annotated[Float64Sequence, Length(9)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 9)
    )
    linear_acceleration: Vector3 = msgspec.field(default_factory=Vector3)
    linear_acceleration_covariance: Annotated[Float64Sequence, Length(9)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 9)
    )
