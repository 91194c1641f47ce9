"""QoS profiles as rclpy has them, to and from callboard's."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.qos.profile import (
    UNLIMITED,
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from actors.time.types import INFINITE, Duration

if TYPE_CHECKING:
    from actors.bridges.ros2.importing import Ros


def to_ros(ros: Ros, profile: QoSProfile) -> Any:
    """Return rclpy's profile with the policies of callboard's; their numbers are the same."""
    qos = ros.rclpy.qos
    return qos.QoSProfile(
        history=qos.HistoryPolicy(int(profile.history)),
        depth=profile.depth,
        reliability=qos.ReliabilityPolicy(int(profile.reliability)),
        durability=qos.DurabilityPolicy(int(profile.durability)),
        deadline=_to_ros_time(ros, profile.deadline),
        lifespan=_to_ros_time(ros, profile.lifespan),
        liveliness=qos.LivelinessPolicy(int(profile.liveliness)),
        liveliness_lease_duration=_to_ros_time(ros, profile.liveliness_lease_duration),
    )


def from_ros(profile: Any) -> QoSProfile:
    """Return callboard's profile of an endpoint in ROS 2's graph.

    History and depth of remote endpoints are not visible: they are UNKNOWN and 0.
    """
    return QoSProfile(
        history=HistoryPolicy(int(profile.history)),
        depth=profile.depth,
        reliability=ReliabilityPolicy(int(profile.reliability)),
        durability=DurabilityPolicy(int(profile.durability)),
        deadline=_from_ros_time(profile.deadline),
        lifespan=_from_ros_time(profile.lifespan),
        liveliness=LivelinessPolicy(int(profile.liveliness)),
        liveliness_lease_duration=_from_ros_time(profile.liveliness_lease_duration),
    )


def _to_ros_time(ros: Ros, duration: Duration) -> Any:
    unlimited = duration in {UNLIMITED, INFINITE}  # zero is ROS 2's default: no limit
    return ros.rclpy.duration.Duration(nanoseconds=0 if unlimited else duration.nanoseconds)


def _from_ros_time(duration: Any) -> Duration:
    found = Duration(nanoseconds=duration.nanoseconds)
    return UNLIMITED if found >= INFINITE else found
