"""visualization_msgs/msg/Marker."""

from typing import ClassVar

import msgspec

from actors.interfaces.builtin_interfaces.msg._duration import Duration
from actors.interfaces.geometry_msgs.msg._point import Point
from actors.interfaces.geometry_msgs.msg._pose import Pose
from actors.interfaces.geometry_msgs.msg._vector3 import Vector3
from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg._compressed_image import CompressedImage
from actors.interfaces.std_msgs.msg._color_rgba import ColorRGBA
from actors.interfaces.std_msgs.msg._header import Header
from actors.interfaces.types import int32
from actors.interfaces.visualization_msgs.msg._mesh_file import MeshFile
from actors.interfaces.visualization_msgs.msg._uv_coordinate import UVCoordinate


class Marker(Message, type_name="visualization_msgs/msg/Marker"):
    """visualization_msgs/msg/Marker."""

    ARROW: ClassVar[int32] = 0
    CUBE: ClassVar[int32] = 1
    SPHERE: ClassVar[int32] = 2
    CYLINDER: ClassVar[int32] = 3
    LINE_STRIP: ClassVar[int32] = 4
    LINE_LIST: ClassVar[int32] = 5
    CUBE_LIST: ClassVar[int32] = 6
    SPHERE_LIST: ClassVar[int32] = 7
    POINTS: ClassVar[int32] = 8
    TEXT_VIEW_FACING: ClassVar[int32] = 9
    MESH_RESOURCE: ClassVar[int32] = 10
    TRIANGLE_LIST: ClassVar[int32] = 11
    ARROW_STRIP: ClassVar[int32] = 12
    ADD: ClassVar[int32] = 0
    MODIFY: ClassVar[int32] = 0
    DELETE: ClassVar[int32] = 2
    DELETEALL: ClassVar[int32] = 3

    header: Header = msgspec.field(default_factory=Header)
    ns: str = ""
    id: int32 = 0
    type: int32 = 0
    action: int32 = 0
    pose: Pose = msgspec.field(default_factory=Pose)
    scale: Vector3 = msgspec.field(default_factory=Vector3)
    color: ColorRGBA = msgspec.field(default_factory=ColorRGBA)
    lifetime: Duration = msgspec.field(default_factory=Duration)
    frame_locked: bool = False
    points: list[Point] = msgspec.field(default_factory=list[Point])
    colors: list[ColorRGBA] = msgspec.field(default_factory=list[ColorRGBA])
    texture_resource: str = ""
    texture: CompressedImage = msgspec.field(default_factory=CompressedImage)
    uv_coordinates: list[UVCoordinate] = msgspec.field(default_factory=list[UVCoordinate])
    text: str = ""
    mesh_resource: str = ""
    mesh_file: MeshFile = msgspec.field(default_factory=MeshFile)
    mesh_use_embedded_materials: bool = False
