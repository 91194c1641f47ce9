"""Whether a publisher offers the QoS that a subscription requests, by rclpy's rules and texts.

callboard delivers between incompatible endpoints nevertheless, unless one of them is strict, and warns both
(docs/protocol.md §5.4.2).
"""

from __future__ import annotations

from dataclasses import replace
from enum import IntEnum
from typing import TYPE_CHECKING

from actors.qos.profile import DurabilityPolicy, LivelinessPolicy, ReliabilityPolicy

if TYPE_CHECKING:
    from actors.qos.profile import QoSPolicyEnum, QoSProfile
    from actors.time.types import Duration


class QoSPolicyKind(IntEnum):
    """The policies, with rclpy's numbers."""

    INVALID = 1 << 0
    DURABILITY = 1 << 1
    DEADLINE = 1 << 2
    LIVELINESS = 1 << 3
    RELIABILITY = 1 << 4
    HISTORY = 1 << 5
    LIFESPAN = 1 << 6
    DEPTH = 1 << 7
    LIVELINESS_LEASE_DURATION = 1 << 8


class QoSCompatibility(IntEnum):
    """Result of `qos_check_compatible`."""

    OK = 0
    WARNING = 1
    ERROR = 2


def qos_check_compatible(
    publisher_qos: QoSProfile, subscription_qos: QoSProfile
) -> tuple[QoSCompatibility, str]:
    """Compare the QoS that a publisher offers with the QoS that a subscription requests.

    Args:
        publisher_qos: The offered QoS.
        subscription_qos: The requested QoS.

    Returns:
        The verdict and its reasons, each ending in a semicolon; "" if OK. WARNING means that one side leaves
        a policy open, so that the compatibility is unknown.
    """
    errors = [text for _, text in disagreements(publisher_qos, subscription_qos)]
    if errors:
        return QoSCompatibility.ERROR, "".join(f"ERROR: {text};" for text in errors)
    doubts = _doubts(publisher_qos, subscription_qos)
    if doubts:
        return QoSCompatibility.WARNING, "".join(f"WARNING: {text};" for text in doubts)
    return QoSCompatibility.OK, ""


def disagreements(pub: QoSProfile, sub: QoSProfile) -> list[tuple[QoSPolicyKind, str]]:
    """Return each policy in which a subscription requests more than a publisher offers, with a string."""
    found: list[tuple[QoSPolicyKind, str]] = []
    pub, sub = _without_best_available(pub), _without_best_available(sub)
    offered, wanted = pub.resolved(), sub.resolved()
    lease = _shortage(
        "liveliness lease duration", offered.liveliness_lease_duration, wanted.liveliness_lease_duration
    )
    if lease:
        found.append((QoSPolicyKind.LIVELINESS_LEASE_DURATION, lease))
    manual = LivelinessPolicy.MANUAL_BY_TOPIC
    if pub.liveliness is LivelinessPolicy.AUTOMATIC and sub.liveliness is manual:
        text = "Publisher's liveliness is automatic and subscription's is manual by topic"
        found.append((QoSPolicyKind.LIVELINESS, text))
    deadline = _shortage("deadline", offered.deadline, wanted.deadline)
    if deadline:
        found.append((QoSPolicyKind.DEADLINE, deadline))
    reliable = sub.reliability is ReliabilityPolicy.RELIABLE
    if pub.reliability is ReliabilityPolicy.BEST_EFFORT and reliable:
        found.append((QoSPolicyKind.RELIABILITY, "Best effort publisher and reliable subscription"))
    transient = sub.durability is DurabilityPolicy.TRANSIENT_LOCAL
    if pub.durability is DurabilityPolicy.VOLATILE and transient:
        found.append((QoSPolicyKind.DURABILITY, "Volatile publisher and transient local subscription"))
    return found


def _without_best_available(profile: QoSProfile) -> QoSProfile:
    """Return the profile with BEST_AVAILABLE replaced by its value on the wire."""
    resolved = profile.resolved()
    return replace(
        profile,
        **{
            name: getattr(resolved, name)
            for name in ("reliability", "durability", "liveliness")
            if getattr(profile, name).name == "BEST_AVAILABLE"
        },
    )


def _shortage(name: str, offered: Duration, wanted: Duration) -> str:
    """Return why a publisher's time is too long for a subscription, "" if it is not; zero is no limit."""
    if not wanted.nanoseconds:
        return ""
    if not offered.nanoseconds:
        return f"Subscription has a {name}, but publisher does not"
    if wanted < offered:
        return f"Subscription's {name} is less than publisher's"
    return ""


def _doubts(pub: QoSProfile, sub: QoSProfile) -> list[str]:
    """Return a string for each policy that one side leaves open and on which the other side depends."""
    return [
        *_doubt("reliability", (pub.reliability, sub.reliability), *_RELIABILITY),
        *_doubt("durability", (pub.durability, sub.durability), *_DURABILITY),
        *_doubt("liveliness", (pub.liveliness, sub.liveliness), *_LIVELINESS),
    ]


_RELIABILITY = (ReliabilityPolicy.BEST_EFFORT, ReliabilityPolicy.RELIABLE)
_DURABILITY = (DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL)
_LIVELINESS = (LivelinessPolicy.AUTOMATIC, LivelinessPolicy.MANUAL_BY_TOPIC)
"""Of each policy, the weaker offer and the stronger request."""


def _doubt(
    name: str, sides: tuple[QoSPolicyEnum, QoSPolicyEnum], weak: QoSPolicyEnum, strong: QoSPolicyEnum
) -> list[str]:
    pub, sub = sides
    pub_open, sub_open = _is_open(pub), _is_open(sub)
    if pub_open and sub_open:
        return [f"Publisher {name} is {pub.short_key} and subscription {name} is {sub.short_key}"]
    if pub_open and sub is strong:
        return [f"{_spelled(strong)} subscription, but publisher is {pub.short_key}"]
    if pub is weak and sub_open:
        return [f"{_spelled(weak)} publisher, but subscription is {sub.short_key}"]
    return []


def _is_open(policy: QoSPolicyEnum) -> bool:
    return policy.name in {"SYSTEM_DEFAULT", "UNKNOWN"}


def _spelled(policy: QoSPolicyEnum) -> str:
    return policy.short_key.replace("_", " ").capitalize()
