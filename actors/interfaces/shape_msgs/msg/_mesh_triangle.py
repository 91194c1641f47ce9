"""shape_msgs/msg/MeshTriangle."""

from typing import Annotated

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.types import Length, UInt32Array, UInt32Sequence


class MeshTriangle(Message, type_name="shape_msgs/msg/MeshTriangle"):
    """shape_msgs/msg/MeshTriangle."""

    vertex_indices: Annotated[UInt32Sequence, Length(3)] = msgspec.field(
        default_factory=lambda: UInt32Array([0] * 3)
    )
