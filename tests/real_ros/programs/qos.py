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


def presets():
    """Return the profiles that ROS 2 names."""
    return {each.name: _plain(each.value) for each in qos.QoSPresetProfiles if each.name != "BEST_AVAILABLE"}


def preset_best_available():
    """Return the profile that takes what the other end has."""
    return _plain(qos.qos_profile_best_available)


def policies():
    """Return the members of each policy, with their numbers and short keys."""
    kinds = (qos.HistoryPolicy, qos.ReliabilityPolicy, qos.DurabilityPolicy, qos.LivelinessPolicy)
    return {
        kind.__name__: {"members": [(each.name, each.value) for each in kind], "keys": kind.short_keys()}
        for kind in kinds
    }


def depth_alone():
    """Give a profile only a depth."""
    return _plain(qos.QoSProfile(depth=7))


def keep_all_with_depth():
    """Give a profile a depth that KEEP_ALL does not use."""
    return _plain(qos.QoSProfile(history=qos.HistoryPolicy.KEEP_ALL, depth=3))


def nothing():
    """Give a profile neither depth nor history."""
    return _plain(qos.QoSProfile())


def keep_last_without_depth():
    """Give a profile KEEP_LAST without a depth."""
    return _plain(qos.QoSProfile(history=qos.HistoryPolicy.KEEP_LAST))


def negative_depth():
    """Give a profile a negative depth."""
    return _plain(qos.QoSProfile(depth=-1))


def depth_as_float():
    """Give a profile a depth that is no int."""
    return _plain(qos.QoSProfile(depth=1.0))


def unknown_keyword():
    """Give a profile a keyword that it does not have."""
    return _plain(qos.QoSProfile(depth=1, dept=2))


def assignment():
    """Assign to a profile what its constructor takes."""
    profile = qos.QoSProfile(depth=1)
    profile.reliability = 2
    profile.durability = qos.DurabilityPolicy.TRANSIENT_LOCAL
    profile.deadline = Duration(seconds=1.5)
    return _plain(profile)


def equality():
    """Compare profiles."""
    return [
        qos.QoSProfile(depth=1) == qos.QoSProfile(depth=1),
        qos.QoSProfile(depth=1) == qos.QoSProfile(depth=2),
        qos.QoSProfile(depth=10) == qos.qos_profile_system_default,
    ]


def from_short_keys():
    """Get policies by their short keys."""
    return [
        int(qos.ReliabilityPolicy.get_from_short_key("best_effort")),
        int(qos.DurabilityPolicy.get_from_short_key("TRANSIENT_LOCAL")),
        int(qos.HistoryPolicy.get_from_short_key("keep_all")),
    ]


def unknown_short_key():
    """Get a policy by a key that it does not have."""
    return qos.ReliabilityPolicy.get_from_short_key("sometimes")


def compatibility():
    """Check which publishers and subscriptions match."""
    kinds = [
        qos.QoSProfile(
            depth=1, reliability=reliability, durability=durability, deadline=Duration(seconds=sec)
        )
        for reliability in (qos.ReliabilityPolicy.RELIABLE, qos.ReliabilityPolicy.BEST_EFFORT)
        for durability in (qos.DurabilityPolicy.VOLATILE, qos.DurabilityPolicy.TRANSIENT_LOCAL)
        for sec in (1, 2)
    ]
    return [[qos.qos_check_compatible(offered, asked)[0].name for asked in kinds] for offered in kinds]
