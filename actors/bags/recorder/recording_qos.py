"""The QoS of the recorder's subscriptions. Pure.

A subscription requests only what all publishers of its topic offer, as in ROS 2's recorder. It then matches
each of them, and receives latched messages if all of them offer these.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from actors.qos.compatibility import QoSCompatibility, qos_check_compatible
from actors.qos.profile import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

if TYPE_CHECKING:
    from collections.abc import Iterable

DEPTH: Final = 10_000
"""Depth of the subscriptions: messages of a topic that may wait in the node, and of each publisher in the
broker, which limits their bytes as well. ROS 2's recorder has 10, and loses messages whenever it is busy for
a moment."""


def recording_qos(
    offers: Iterable[tuple[QoSProfile, bool]], *, lossless: bool = False, depth: int = DEPTH
) -> QoSProfile:
    """Return the profile of a subscription that matches all publishers of a topic.

    Args:
        offers: The QoS of each publisher, and whether it is strict; empty if there are no publishers yet.
        lossless: Let publishers wait for the recorder (KEEP_ALL) rather than lose messages.
        depth: The depth of the profile.

    Returns:
        The profile. Without publishers it is BEST_EFFORT and VOLATILE, which matches any publisher.
    """
    found = list(offers)
    best_effort = ReliabilityPolicy.BEST_EFFORT
    reliable = bool(found) and all(qos.reliability is not best_effort for qos, _ in found)
    # KEEP_ALL needs RELIABLE. Only a strict publisher that offers less would not match then.
    if lossless and not any(strict and qos.reliability is best_effort for qos, strict in found):
        reliable = True
    latched = bool(found) and all(qos.durability is DurabilityPolicy.TRANSIENT_LOCAL for qos, _ in found)
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL if lossless else HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else best_effort,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def unheard(offers: Iterable[tuple[QoSProfile, bool]], requested: QoSProfile) -> str:
    """Return why a strict publisher does not match a subscription; "" if all match.

    Args:
        offers: As for `recording_qos`.
        requested: The QoS of the subscription.
    """
    for offered, strict in offers:
        verdict, text = qos_check_compatible(offered, requested)
        if strict and verdict is QoSCompatibility.ERROR:
            return text.removeprefix("ERROR: ").rstrip(";")
    return ""
