"""Keys of endpoints in a mesh, and how the numbers of brokers are written."""

from __future__ import annotations

_NUMBER_BITS = 32


def mesh_key(broker: int, number: int) -> int:
    """Return the key of an endpoint, which is unique in the mesh.

    Args:
        broker: The number of its broker; 0 without a mesh.
        number: Its number at that broker.
    """
    return broker << _NUMBER_BITS | number


def broker_of_key(key: int) -> int:
    """Return the number of the broker that an endpoint's key names; 0 without a mesh."""
    return key >> _NUMBER_BITS


def broker_id(broker: int) -> str:
    """Return the id of a broker as people and callboard's keys in Zenoh have it: eight hexadecimal digits.

    Args:
        broker: The number of the broker.
    """
    return f"{broker:08x}"


def zenoh_id(broker: int) -> str:
    """Return the id of a broker's Zenoh session, which has no leading zeros.

    Args:
        broker: The number of the broker.
    """
    return f"{broker:x}"
