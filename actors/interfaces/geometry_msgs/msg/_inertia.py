"""geometry_msgs/msg/Inertia."""

import msgspec

from actors.interfaces.geometry_msgs.msg._vector3 import Vector3
from actors.interfaces.message import Message
from actors.interfaces.types import float64


class Inertia(Message, type_name="geometry_msgs/msg/Inertia"):
    """Mass and inertia of a rigid body."""

    m: float64 = 0.0
    """Mass, in kilograms."""
    com: Vector3 = msgspec.field(default_factory=Vector3)
    """Position of the centre of mass, in metres."""
    ixx: float64 = 0.0
    """Moment of inertia about x, in kg m^2."""
    ixy: float64 = 0.0
    """Element xy of the symmetric inertia tensor, in kg m^2."""
    ixz: float64 = 0.0
    """Element xz of the symmetric inertia tensor, in kg m^2."""
    iyy: float64 = 0.0
    """Moment of inertia about y, in kg m^2."""
    iyz: float64 = 0.0
    """Element yz of the symmetric inertia tensor, in kg m^2."""
    izz: float64 = 0.0
    """Moment of inertia about z, in kg m^2."""
