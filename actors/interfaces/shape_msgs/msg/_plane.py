"""shape_msgs/msg/Plane."""

from typing import Annotated

import msgspec

from actors.interfaces.message import Message
from actors.interfaces.types import Float64Array, Float64Sequence, Length


class Plane(Message, type_name="shape_msgs/msg/Plane"):
    """shape_msgs/msg/Plane."""

    coef: Annotated[Float64Sequence, Length(4)] = msgspec.field(
        default_factory=lambda: Float64Array([0.0] * 4)
    )
