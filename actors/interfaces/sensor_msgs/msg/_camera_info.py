"""sensor_msgs/msg/CameraInfo."""

from typing import Annotated

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg._region_of_interest import RegionOfInterest
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Float64Array, Float64Sequence, Length, uint32


class CameraInfo(Message, type_name="sensor_msgs/msg/CameraInfo"):
    """Calibration of a camera, for one image."""

    header: Header = msgspec.field(default_factory=Header)
    """Time when the image was taken; optical frame of the camera (x right, y down, z forward)."""
    height: uint32 = 0
    """Rows of the image that was calibrated (full resolution), in pixels."""
    width: uint32 = 0
    """Columns of the image that was calibrated (full resolution), in pixels."""
    distortion_model: str = ""
    """Lens model that d belongs to: plumb_bob, rational_polynomial or equidistant."""
    d: Float64Sequence = msgspec.field(default_factory=Float64Array)
    """Distortion coefficients of the model; plumb_bob has k1, k2, t1, t2, k3."""
    k: Annotated[Float64Sequence, Length(9)] = msgspec.field(default_factory=lambda: Float64Array([0.0] * 9))
    """Intrinsic matrix of the raw image, 3x3, row-major: fx 0 cx, 0 fy cy, 0 0 1, in pixels."""
    r: Annotated[Float64Sequence, Length(9)] = msgspec.field(default_factory=lambda: Float64Array([0.0] * 9))
    """Rotation from the camera to the rectified (stereo) frame, 3x3, row-major."""
    p: Annotated[Float64Sequence, Length(12)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 12)
    )
    """Projects points in metres onto the rectified image in pixels: matrix 3x4, row-major."""
    binning_x: uint32 = 0
    """Sensor columns that were combined into one image column; 0 and 1 mean no binning."""
    binning_y: uint32 = 0
    """Sensor rows that were combined into one image row; 0 and 1 mean no binning."""
    roi: RegionOfInterest = msgspec.field(default_factory=RegionOfInterest)
    """Part of the sensor that the image shows, in unbinned pixels; all 0 means everything."""
