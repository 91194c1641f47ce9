"""The messages that are sent: each kind filled as a real one would be, of a size that is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import actors
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Quaternion, Vector3
from actors.interfaces.sensor_msgs.msg import Image, Imu, PointCloud2, PointField
from actors.interfaces.std_msgs.msg import Header, String, UInt8MultiArray

if TYPE_CHECKING:
    from collections.abc import Callable

KEEP_ALL: Final = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)

LONGEST_TEXT_BYTES: Final = 4096
"""Nobody sends texts that are longer; from here on it is binary data."""

_POINT_BYTES: Final = 16
_ROW_PIXELS: Final = 640
_DIAGONAL: Final = [0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.02]


def plain(size: int) -> actors.Message:
    """Return a message that is nothing but its payload."""
    if size <= LONGEST_TEXT_BYTES:
        return String(data="x" * size)
    return UInt8MultiArray(data=bytes(size))


def array(size: int) -> actors.Message:
    """Return binary data of any size."""
    return UInt8MultiArray(data=bytes(size))


def imu(_size: int) -> actors.Message:
    """Return what an inertial sensor sends; its size is given by its type."""
    return Imu(
        header=_header("imu_link"),
        orientation=Quaternion(x=0.1, y=0.2, z=0.3, w=0.927),
        orientation_covariance=list(_DIAGONAL),
        angular_velocity=Vector3(x=0.01, y=-0.02, z=0.5),
        angular_velocity_covariance=list(_DIAGONAL),
        linear_acceleration=Vector3(x=0.2, y=0.1, z=9.81),
        linear_acceleration_covariance=list(_DIAGONAL),
    )


def image(size: int) -> actors.Message:
    """Return an rgb8 picture of about `size` bytes."""
    step = 3 * _ROW_PIXELS
    height = size // step
    return Image(
        header=_header("camera"),
        height=height,
        width=_ROW_PIXELS,
        encoding="rgb8",
        step=step,
        data=bytes(height * step),
    )


def point_cloud(size: int) -> actors.Message:
    """Return a cloud of about `size` bytes."""
    width = size // _POINT_BYTES
    fields = [PointField(name=name, offset=4 * i, datatype=7, count=1) for i, name in enumerate("xyzi")]
    return PointCloud2(
        header=_header("lidar"),
        height=1,
        width=width,
        fields=fields,
        point_step=_POINT_BYTES,
        row_step=width * _POINT_BYTES,
        data=bytes(width * _POINT_BYTES),
        is_dense=True,
    )


def _header(frame_id: str) -> Header:
    return Header(stamp=Time(sec=1_700_000_000, nanosec=123_456_789), frame_id=frame_id)


KINDS: Final[dict[str, Callable[[int], actors.Message]]] = {
    "plain": plain,
    "array": array,
    "imu": imu,
    "image": image,
    "point_cloud": point_cloud,
}
