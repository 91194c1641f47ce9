"""sensor_msgs/srv/SetCameraInfo."""

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.sensor_msgs.msg._camera_info import CameraInfo


class SetCameraInfo(Service, type_name="sensor_msgs/srv/SetCameraInfo"):
    """Store a calibration in a camera."""

    class Request(Message):
        """The request."""

        camera_info: CameraInfo = msgspec.field(default_factory=CameraInfo)
        """Calibration that the camera stores and publishes from now on."""

    class Response(Message):
        """The response."""

        success: bool = False
        """True if the calibration was stored."""
        status_message: str = ""
        """Human-readable explanation, such as why it failed."""
