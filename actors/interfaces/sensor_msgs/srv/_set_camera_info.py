"""sensor_msgs/srv/SetCameraInfo."""

import msgspec

from actors.interfaces.message import Message, Service
from actors.interfaces.sensor_msgs.msg._camera_info import CameraInfo


class SetCameraInfo(Service, type_name="sensor_msgs/srv/SetCameraInfo"):
    """sensor_msgs/srv/SetCameraInfo."""

    class Request(Message):
        """The request."""

        camera_info: CameraInfo = msgspec.field(default_factory=CameraInfo)

    class Response(Message):
        """The response."""

        success: bool = False
        status_message: str = ""
