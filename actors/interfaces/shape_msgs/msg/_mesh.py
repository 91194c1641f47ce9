"""shape_msgs/msg/Mesh."""

import msgspec

from actors.interfaces.geometry_msgs.msg._point import Point
from actors.interfaces.message import Message
from actors.interfaces.shape_msgs.msg._mesh_triangle import MeshTriangle


class Mesh(Message, type_name="shape_msgs/msg/Mesh"):
    """shape_msgs/msg/Mesh."""

    triangles: list[MeshTriangle] = msgspec.field(default_factory=list[MeshTriangle])
    vertices: list[Point] = msgspec.field(default_factory=list[Point])
