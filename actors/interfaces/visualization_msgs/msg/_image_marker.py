"""visualization_msgs/msg/ImageMarker."""

from typing import ClassVar

import msgspec

from actors.interfaces.builtin_interfaces.msg._duration import Duration
from actors.interfaces.geometry_msgs.msg._point import Point
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg._color_rgba import ColorRGBA
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import float32, int32, uint8


class ImageMarker(Message, type_name="visualization_msgs/msg/ImageMarker"):
    """visualization_msgs/msg/ImageMarker."""

    CIRCLE: ClassVar[int32] = 0
    LINE_STRIP: ClassVar[int32] = 1
    LINE_LIST: ClassVar[int32] = 2
    POLYGON: ClassVar[int32] = 3
    POINTS: ClassVar[int32] = 4
    ADD: ClassVar[int32] = 0
    REMOVE: ClassVar[int32] = 1

    header: Header = msgspec.field(default_factory=Header)
    ns: str = ""
    id: int32 = 0
    type: int32 = 0
    action: int32 = 0
    position: Point = msgspec.field(default_factory=Point)
    scale: float32 = 0.0
    outline_color: ColorRGBA = msgspec.field(default_factory=ColorRGBA)
    filled: uint8 = 0
    fill_color: ColorRGBA = msgspec.field(default_factory=ColorRGBA)
    lifetime: Duration = msgspec.field(default_factory=Duration)
    points: list[Point] = msgspec.field(default_factory=list[Point])
    outline_colors: list[ColorRGBA] = msgspec.field(default_factory=list[ColorRGBA])
