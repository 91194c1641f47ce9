"""geometry_msgs/msg/Vector3."""

from actors.interfaces.message import Message
from actors.interfaces.types import float64


class Vector3(Message, type_name="geometry_msgs/msg/Vector3"):
    """A direction with a length, not a place: translations do not move it."""

    x: float64 = 0.0
    """Component along x, in the unit of the quantity (metres for a translation)."""
    y: float64 = 0.0
    """Component along y, in the unit of the quantity."""
    z: float64 = 0.0
    """Component along z, in the unit of the quantity."""
