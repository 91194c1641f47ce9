"""Messages of shape_msgs."""

from typing import TYPE_CHECKING

from actors.interfaces.lazy import lazy_exports

if TYPE_CHECKING:
    from actors.interfaces.shape_msgs.msg._mesh import Mesh
    from actors.interfaces.shape_msgs.msg._mesh_triangle import MeshTriangle
    from actors.interfaces.shape_msgs.msg._plane import Plane
    from actors.interfaces.shape_msgs.msg._solid_primitive import SolidPrimitive

__all__ = [
    "Mesh",
    "MeshTriangle",
    "Plane",
    "SolidPrimitive",
]

if not TYPE_CHECKING:
    __getattr__ = lazy_exports(
        __name__,
        {
            "Mesh": "_mesh",
            "MeshTriangle": "_mesh_triangle",
            "Plane": "_plane",
            "SolidPrimitive": "_solid_primitive",
        },
    )
