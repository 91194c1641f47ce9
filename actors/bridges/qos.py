"""The QoS of mirrors, from what their originals offer and request.

A mirror publisher offers what its original offers. The subscriptions that receive a topic (its intake) follow
its publishers: they match all of them, and get as much as each offers. Publishers that differ in reliability
or durability need more than one subscription: each message is then accepted from the one that `receiver_of`
names for its publisher, and dropped where it arrives as well.

Other networks do not show the history and depth of an endpoint. For those, and where a burst must fit, the
depths are here; rules can change them for each topic.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

from actors.qos.profile import (
    UNLIMITED,
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from actors.time.types import INFINITE
from proto.limits import MAX_DEPTH

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

    from actors.time.types import Duration

DEFAULT_DEPTH: Final = 10
"""Messages that a mirror keeps if its original's depth is unknown."""
VOLATILE_DEPTH: Final = 100
"""The least depth of volatile topics: as many messages as the bridge's loop may read in one turn."""
KEEP_ALL_DEPTH: Final = 1000
"""Replaces KEEP_ALL in another network, where publishing to a full queue would block the whole bridge."""
LATCHED_DEPTH_PER_PUBLISHER: Final = 10
"""Depth in an intake for the latched messages of each publisher, which arrive together."""
STANDARD_DEPTHS: Final = {"/rosout": 1000, "/parameter_events": 1000}
"""Depths of ROS 2's own topics (rmw's qos_profiles.h)."""
_ACTION_STATUS: Final = "/_action/status"
"""The end of the names of topics whose publishers keep one message (rcl_action's default profile)."""

_RELIABLE: Final = ReliabilityPolicy.RELIABLE
_LATCHED: Final = DurabilityPolicy.TRANSIENT_LOCAL
_Pair = tuple[ReliabilityPolicy, DurabilityPolicy]


def mirror_offer(name: str, original: QoSProfile, depth: int | None = None) -> QoSProfile:
    """Return what the mirror of a publisher offers.

    Args:
        name: The topic's full name, without a bridge's namespace.
        original: What the original offers; its history may be unknown.
        depth: The depth that a rule sets, in messages; None for none.

    Returns:
        A resolved KEEP_LAST profile.
    """
    return _offer(original, depth or _depth(name, original))


def mirror_request(original: QoSProfile) -> QoSProfile:
    """Return what the mirror of a subscription requests while nothing is published on its side.

    Args:
        original: What the original requests.
    """
    return _offer(original, VOLATILE_DEPTH)


def merged_offer(offers: Collection[QoSProfile]) -> QoSProfile:
    """Return what one mirror offers for several publishers of a node on one topic.

    Every subscription that matches one of the originals matches it, unless it requests a deadline or a lease
    that one of them does not offer.

    Args:
        offers: What `mirror_offer` returns for each; at least one.
    """
    if len(offers) == 1:
        return next(iter(offers))
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=max(offer.depth for offer in offers),
        reliability=min(offer.reliability for offer in offers),
        durability=min(offer.durability for offer in offers),
        deadline=_longest(offer.deadline for offer in offers),
        lifespan=_longest(offer.lifespan for offer in offers),
        liveliness=max(offer.liveliness for offer in offers),
        liveliness_lease_duration=_longest(offer.liveliness_lease_duration for offer in offers),
    )


def common_offer(offers: Collection[QoSProfile]) -> QoSProfile:
    """Return what all publishers of a node on one topic offer: the edge tells nodes apart, not publishers.

    Args:
        offers: What each offers; at least one.
    """
    first = max(offers, key=lambda offer: (offer.history is HistoryPolicy.KEEP_ALL, offer.depth))
    if len(offers) == 1:
        return first
    pairs = [_pair(offer) for offer in offers]
    return QoSProfile(
        history=first.history,
        depth=first.depth,
        reliability=max(reliability for reliability, _ in pairs),
        durability=max(durability for _, durability in pairs),
        deadline=_longest(offer.deadline for offer in offers),
        liveliness=min(offer.liveliness for offer in offers),
        liveliness_lease_duration=_longest(offer.liveliness_lease_duration for offer in offers),
    )


def intake_profiles(
    name: str, offers: Collection[QoSProfile], depth: int | None = None
) -> tuple[QoSProfile, ...]:
    """Return the QoS of the subscriptions that receive a topic.

    Args:
        name: The topic's full name, without a bridge's namespace.
        offers: What the publishers of each node have in common; at least one.
        depth: The depth that a rule sets, in messages; None for none.

    Returns:
        One profile for each combination of reliability and durability that is offered, the strongest first.
        The last one matches all publishers.
    """
    pairs = sorted({_pair(offer) for offer in offers})
    # What is best effort and latched and what is reliable and volatile have only the weakest in common.
    weakest = (max(pair[0] for pair in pairs), max(pair[1] for pair in pairs))
    if weakest not in pairs:
        pairs.append(weakest)
    return tuple(_intake(name, offers, pair, depth) for pair in pairs)


def receiver_of(profiles: tuple[QoSProfile, ...], offer: QoSProfile) -> int:
    """Return the index of the subscription whose messages of a publisher are accepted.

    Args:
        profiles: The QoS of the subscriptions of an intake, as `intake_profiles` returns them.
        offer: What the publisher offers.

    Returns:
        The first that the publisher matches; the last one if its offer is newer than the profiles.
    """
    offered = _pair(offer)
    for index, profile in enumerate(profiles):
        if offered[0] <= profile.reliability and offered[1] <= profile.durability:
            return index
    return len(profiles) - 1


def is_latched(offer: QoSProfile) -> bool:
    """Return whether late joiners get old messages."""
    return offer.durability is _LATCHED


def _pair(offer: QoSProfile) -> _Pair:
    """Return reliability and durability, with open policies as on the wire; the stronger value is less."""
    best_effort = offer.reliability is ReliabilityPolicy.BEST_EFFORT
    return (
        ReliabilityPolicy.BEST_EFFORT if best_effort else _RELIABLE,
        _LATCHED if offer.durability is _LATCHED else DurabilityPolicy.VOLATILE,
    )


@lru_cache(maxsize=1000)  # endpoints have few different profiles, and each plan asks for all of them
def _offer(original: QoSProfile, depth: int) -> QoSProfile:
    profile = original.resolved()
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=profile.reliability,
        durability=profile.durability,
        deadline=profile.deadline,
        lifespan=profile.lifespan,
        liveliness=profile.liveliness,
        liveliness_lease_duration=profile.liveliness_lease_duration,
    )


def _depth(name: str, original: QoSProfile) -> int:
    if original.history is HistoryPolicy.KEEP_ALL:
        return KEEP_ALL_DEPTH
    if original.history is HistoryPolicy.KEEP_LAST and original.depth:
        known = original.depth
    elif name.endswith(_ACTION_STATUS):
        known = 1
    else:
        known = STANDARD_DEPTHS.get(name, DEFAULT_DEPTH)
    return known if is_latched(original) else max(known, VOLATILE_DEPTH)


def _intake(name: str, offers: Collection[QoSProfile], pair: _Pair, depth: int | None) -> QoSProfile:
    # A bridge that takes messages at its own pace holds KEEP_ALL publishers back, as any slow reader does.
    keep_all = pair[0] is _RELIABLE and any(offer.history is HistoryPolicy.KEEP_ALL for offer in offers)
    if depth is None:
        latched = LATCHED_DEPTH_PER_PUBLISHER * len(offers) if pair[1] is _LATCHED else 0
        depth = min(max(latched, *(_depth(name, offer) for offer in offers), VOLATILE_DEPTH), MAX_DEPTH)
    manual = all(offer.liveliness is LivelinessPolicy.MANUAL_BY_TOPIC for offer in offers)
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL if keep_all else HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=pair[0],
        durability=pair[1],
        deadline=_longest(offer.deadline for offer in offers),
        liveliness=LivelinessPolicy.MANUAL_BY_TOPIC if manual else LivelinessPolicy.AUTOMATIC,
        liveliness_lease_duration=_longest(offer.liveliness_lease_duration for offer in offers),
    )


def _longest(durations: Iterable[Duration]) -> Duration:
    """Return the longest time; no limit if one of them has none."""
    found = list(durations)
    return UNLIMITED if UNLIMITED in found or INFINITE in found else max(found)
