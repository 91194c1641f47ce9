"""QoS profiles, policies and what is made of them."""

from __future__ import annotations

from rclpy import qos
from rclpy.duration import Duration

FIELDS = ("history", "depth", "reliability", "durability", "lifespan", "deadline", "liveliness")
FIELDS += ("liveliness_lease_duration", "avoid_ros_namespace_conventions")


def _plain(profile):
    values = {name: getattr(profile, name) for name in FIELDS}
    return {
        name: value.nanoseconds if isinstance(value, Duration) else getattr(value, "name", value)
        for name, value in values.items()
    }


def policies():
    """Return the members of each policy, with their numbers and short keys."""
    kinds = (qos.HistoryPolicy, qos.ReliabilityPolicy, qos.DurabilityPolicy, qos.LivelinessPolicy)
    return {
        kind.__name__: {"members": [(each.name, each.value) for each in kind], "keys": kind.short_keys()}
        for kind in kinds
    }


def unknown_keyword():
    """Give a profile a keyword that it does not have."""
    return _plain(qos.QoSProfile(depth=1, dept=2))


def equality():
    """Compare profiles."""
    return [
        qos.QoSProfile(depth=1) == qos.QoSProfile(depth=1),
        qos.QoSProfile(depth=1) == qos.QoSProfile(depth=2),
        qos.QoSProfile(depth=10) == qos.qos_profile_system_default,
    ]
