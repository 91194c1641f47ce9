"""stereo_msgs/msg/DisparityImage."""

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg._image import Image
from actors.interfaces.sensor_msgs.msg._region_of_interest import RegionOfInterest
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import float32


class DisparityImage(Message, type_name="stereo_msgs/msg/DisparityImage"):
    """stereo_msgs/msg/DisparityImage."""

    header: Header = msgspec.field(default_factory=Header)
    image: Image = msgspec.field(default_factory=Image)
    f: float32 = 0.0
    t: float32 = 0.0
    valid_window: RegionOfInterest = msgspec.field(default_factory=RegionOfInterest)
    min_disparity: float32 = 0.0
    max_disparity: float32 = 0.0
    delta_d: float32 = 0.0
