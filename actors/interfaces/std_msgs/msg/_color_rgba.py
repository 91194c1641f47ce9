"""std_msgs/msg/ColorRGBA."""

from actors.interfaces.message import Message
from actors.interfaces.types import float32


class ColorRGBA(Message, type_name="std_msgs/msg/ColorRGBA"):
    """A colour with its opacity."""

    r: float32 = 0.0
    """Red, from 0 to 1."""
    g: float32 = 0.0
    """Green, from 0 to 1."""
    b: float32 = 0.0
    """Blue, from 0 to 1."""
    a: float32 = 0.0
    """Opacity, from 0 (invisible) to 1 (opaque)."""
