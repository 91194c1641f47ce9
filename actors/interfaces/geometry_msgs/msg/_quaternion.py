"""geometry_msgs/msg/Quaternion."""

from actors.interfaces.message import Message
from actors.interfaces.types import float64


class Quaternion(Message, type_name="geometry_msgs/msg/Quaternion"):
    """An orientation, as a unit quaternion."""

    x: float64 = 0.0
    """Imaginary part along x; the four values have the norm 1."""
    y: float64 = 0.0
    """Imaginary part along y."""
    z: float64 = 0.0
    """Imaginary part along z."""
    w: float64 = 1.0
    """Real part; 1 with x, y and z 0 is no rotation."""
