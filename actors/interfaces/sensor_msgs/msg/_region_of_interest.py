"""sensor_msgs/msg/RegionOfInterest."""

from actors.interfaces.message import Message
from actors.interfaces.types import uint32


class RegionOfInterest(Message, type_name="sensor_msgs/msg/RegionOfInterest"):
    """sensor_msgs/msg/RegionOfInterest."""

    x_offset: uint32 = 0
    y_offset: uint32 = 0
    height: uint32 = 0
    width: uint32 = 0
    do_rectify: bool = False
