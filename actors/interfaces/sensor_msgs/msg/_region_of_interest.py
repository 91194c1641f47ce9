"""sensor_msgs/msg/RegionOfInterest."""

from actors.interfaces.message import Message
from actors.interfaces.types import uint32


class RegionOfInterest(Message, type_name="sensor_msgs/msg/RegionOfInterest"):
    """A rectangle of an image."""

    x_offset: uint32 = 0
    """First column of the region, in pixels from the left."""
    y_offset: uint32 = 0
    """First row of the region, in pixels from the top."""
    height: uint32 = 0
    """Rows of the region, in pixels."""
    width: uint32 = 0
    """Columns of the region, in pixels."""
    do_rectify: bool = False
    """True if the region is to be recomputed for the rectified image (usual for a part of it)."""
