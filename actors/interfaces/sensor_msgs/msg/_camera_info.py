"""sensor_msgs/msg/CameraInfo."""

from typing import Annotated

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg._region_of_interest import RegionOfInterest
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import Float64Array, Float64Sequence, Length, uint32


class CameraInfo(Message, type_name="sensor_msgs/msg/CameraInfo"):
    """sensor_msgs/msg/CameraInfo."""

    header: Header = msgspec.field(default_factory=Header)
    height: uint32 = 0
    width: uint32 = 0
    distortion_model: str = ""
    d: Float64Sequence = msgspec.field(default_factory=Float64Array)
    k: Annotated[Float64Sequence, Length(9)] = msgspec.field(default_factory=lambda: Float64Array([0.0] * 9))
    r: Annotated[Float64Sequence, Length(9)] = msgspec.field(default_factory=lambda: Float64Array([0.0] * 9))
    p: Annotated[Float64Sequence, Length(12)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 12)
    )
    binning_x: uint32 = 0
    binning_y: uint32 = 0
    roi: RegionOfInterest = msgspec.field(default_factory=RegionOfInterest)
