"""The QoS of the player's publishers. Pure.

A publisher offers what the recorded publishers of its topic offered. If they differed, it offers the
strongest value of each policy, which matches each subscription that one of them matched.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.qos.profile import (
    UNLIMITED,
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actors.time.types import Duration

MAX_DEPTH: Final = 10_000
"""Limit for the depth, since a bag may state any number."""


def playing_qos(offers: Iterable[QoSProfile]) -> QoSProfile:
    """Return the profile of a publisher that replaces all recorded publishers of a topic.

    Args:
        offers: The QoS that they offered; empty if the bag does not say.

    Returns:
        The strongest value of each policy. Depths of latched topics are added up, so that a late subscription
        gets the last messages of each publisher. There is no lifespan: messages keep their original publish
        times, and would all have expired.
    """
    found = list(offers)
    if not found:
        return QoSProfile(depth=10)
    latched = [each for each in found if each.durability is DurabilityPolicy.TRANSIENT_LOCAL]
    depth = sum(each.depth for each in latched) or max(each.depth for each in found)
    keeps_all = any(each.history is HistoryPolicy.KEEP_ALL for each in found)
    is_reliable = any(each.reliability is not ReliabilityPolicy.BEST_EFFORT for each in found)
    is_manual = any(each.liveliness is LivelinessPolicy.MANUAL_BY_TOPIC for each in found)
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL if keeps_all else HistoryPolicy.KEEP_LAST,
        depth=min(max(depth, 1), MAX_DEPTH),
        reliability=ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        deadline=_shortest(each.deadline for each in found),
        liveliness=LivelinessPolicy.MANUAL_BY_TOPIC if is_manual else LivelinessPolicy.AUTOMATIC,
        liveliness_lease_duration=_shortest(each.liveliness_lease_duration for each in found),
    )


def _shortest(durations: Iterable[Duration]) -> Duration:
    return min((each for each in durations if each != UNLIMITED), default=UNLIMITED)
