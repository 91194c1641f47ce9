"""Services of sensor_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.sensor_msgs.srv._set_camera_info import SetCameraInfo

__all__ = [
    "SetCameraInfo",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "SetCameraInfo": "_set_camera_info",
        },
    )
