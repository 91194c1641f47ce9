"""shape_msgs/msg/SolidPrimitive."""

from typing import Annotated, ClassVar

import msgspec

from actors.interfaces.geometry_msgs.msg._polygon import Polygon
from actors.interfaces.message import Message
from actors.interfaces.types import AtMost, Float64Array, Float64Sequence, uint8


class SolidPrimitive(Message, type_name="shape_msgs/msg/SolidPrimitive"):
    """shape_msgs/msg/SolidPrimitive."""

    BOX: ClassVar[uint8] = 1
    SPHERE: ClassVar[uint8] = 2
    CYLINDER: ClassVar[uint8] = 3
    CONE: ClassVar[uint8] = 4
    PRISM: ClassVar[uint8] = 5
    BOX_X: ClassVar[uint8] = 0
    BOX_Y: ClassVar[uint8] = 1
    BOX_Z: ClassVar[uint8] = 2
    SPHERE_RADIUS: ClassVar[uint8] = 0
    CYLINDER_HEIGHT: ClassVar[uint8] = 0
    CYLINDER_RADIUS: ClassVar[uint8] = 1
    CONE_HEIGHT: ClassVar[uint8] = 0
    CONE_RADIUS: ClassVar[uint8] = 1
    PRISM_HEIGHT: ClassVar[uint8] = 0

    type: uint8 = 0
    dimensions: Annotated[Float64Sequence, AtMost(3)] = msgspec.field(default_factory=Float64Array)
    polygon: Polygon = msgspec.field(default_factory=Polygon)
