"""The QoS of mirrors, from what their originals offer and request."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.bridges.qos import (
    DEFAULT_DEPTH,
    KEEP_ALL_DEPTH,
    VOLATILE_DEPTH,
    intake_profiles,
    is_latched,
    merged_offer,
    mirror_offer,
    mirror_request,
    receiver_of,
)
from actors.qos.compatibility import disagreements
from actors.qos.profile import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_unknown,
)
from actors.time.types import INFINITE, Duration

if TYPE_CHECKING:
    from collections.abc import Sequence

RELIABLE, BEST_EFFORT = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
LATCHED, VOLATILE = DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE
TIMES = st.sampled_from([Duration(), INFINITE, Duration(seconds=1), Duration(seconds=2)])
OFFERS = st.builds(
    QoSProfile,
    history=st.sampled_from([HistoryPolicy.KEEP_LAST, HistoryPolicy.KEEP_ALL, HistoryPolicy.UNKNOWN]),
    depth=st.integers(1, 2000),
    reliability=st.sampled_from([RELIABLE, BEST_EFFORT]),
    durability=st.sampled_from([LATCHED, VOLATILE]),
    deadline=TIMES,
    lifespan=TIMES,
    liveliness=st.sampled_from([LivelinessPolicy.AUTOMATIC, LivelinessPolicy.MANUAL_BY_TOPIC]),
    liveliness_lease_duration=TIMES,
)


def unknown(**policies: object) -> QoSProfile:
    """Return a profile as another network shows it: without history and depth."""
    return QoSProfile(history=HistoryPolicy.UNKNOWN, depth=0, **policies)  # type: ignore[arg-type]


def kinds(profiles: Sequence[QoSProfile]) -> list[tuple[ReliabilityPolicy, DurabilityPolicy]]:
    """Return reliability and durability of each profile."""
    return [(each.reliability, each.durability) for each in profiles]


@given(OFFERS, OFFERS)
def test_a_mirror_offers_what_its_original_offers(original: QoSProfile, request: QoSProfile) -> None:
    """A subscription matches the mirror of a publisher exactly if it matches the publisher."""
    mirror = mirror_offer("/t", original)
    assert disagreements(mirror, request) == disagreements(original.resolved(), request)
    assert mirror.history is HistoryPolicy.KEEP_LAST
    assert mirror.lifespan == original.resolved().lifespan


@pytest.mark.parametrize(
    ("name", "original", "depth"),
    [
        ("/t", unknown(), VOLATILE_DEPTH),
        ("/t", unknown(durability=LATCHED), DEFAULT_DEPTH),
        ("/dock/_action/status", unknown(durability=LATCHED), 1),
        ("/rosout", unknown(durability=LATCHED), 1000),
        ("/parameter_events", unknown(), 1000),
        ("/t", QoSProfile(depth=1, durability=LATCHED), 1),
        ("/t", QoSProfile(depth=1), VOLATILE_DEPTH),
        ("/t", QoSProfile(depth=500), 500),
        ("/t", QoSProfile(history=HistoryPolicy.KEEP_ALL), KEEP_ALL_DEPTH),
        ("/t", qos_profile_unknown, VOLATILE_DEPTH),
    ],
)
def test_depths(name: str, original: QoSProfile, depth: int) -> None:
    """A known depth of latched messages is kept; otherwise a default applies, and a rule comes first."""
    assert mirror_offer(name, original).depth == depth
    assert mirror_offer(name, original, 7).depth == 7


@given(st.lists(OFFERS, min_size=1, max_size=5))
def test_an_intake_gets_from_each_publisher_what_it_offers(offers: list[QoSProfile]) -> None:
    """Each publisher has a subscription that it matches and that asks for its reliability and durability."""
    profiles = intake_profiles("/t", offers)
    for offer in offers:
        receiver = profiles[receiver_of(profiles, offer)]
        assert not disagreements(offer, receiver)
        assert kinds([receiver]) == kinds([offer])
        assert not disagreements(offer, profiles[-1])
    assert len(set(kinds(profiles))) == len(profiles) <= 4


def test_like_publishers_need_one_subscription() -> None:
    """Reliable and latched publishers are received by one subscription that is both."""
    (profile,) = intake_profiles("/t", [unknown(durability=LATCHED)] * 20)
    assert kinds([profile]) == [(RELIABLE, LATCHED)]
    # All of them send what they have kept at once.
    assert profile.depth == 200


def test_mixed_publishers_need_a_subscription_each() -> None:
    """The strongest profile comes first, and the last matches all."""
    latched, lossy = unknown(durability=LATCHED), unknown(reliability=BEST_EFFORT)
    assert kinds(intake_profiles("/t", [lossy, latched])) == [(RELIABLE, LATCHED), (BEST_EFFORT, VOLATILE)]
    odd = [unknown(reliability=BEST_EFFORT, durability=LATCHED), unknown()]
    assert kinds(intake_profiles("/t", odd)) == [
        (RELIABLE, VOLATILE),
        (BEST_EFFORT, LATCHED),
        (BEST_EFFORT, VOLATILE),
    ]


def test_a_publisher_that_is_newer_than_the_subscriptions() -> None:
    """What no subscription was made for is accepted from the weakest, until the intake follows."""
    profiles = intake_profiles("/t", [unknown(durability=LATCHED), unknown()])
    assert receiver_of(profiles, unknown(reliability=BEST_EFFORT)) == 1


def test_an_intake_holds_keep_all_publishers_back() -> None:
    """Callboard's KEEP_ALL publishers lose nothing on their way to the bridge; depths follow the others."""
    keep_all = QoSProfile(history=HistoryPolicy.KEEP_ALL)
    (profile,) = intake_profiles("/t", [keep_all, QoSProfile(depth=300)])
    assert profile.history is HistoryPolicy.KEEP_ALL
    (profile,) = intake_profiles("/t", [QoSProfile(depth=300)])
    assert (profile.history, profile.depth) == (HistoryPolicy.KEEP_LAST, 300)
    (profile,) = intake_profiles("/t", [QoSProfile(depth=300)], depth=2)
    assert profile.depth == 2


def test_times_of_an_intake() -> None:
    """Deadline and lease are the longest that is offered, and none if one publisher offers none."""
    one, two = unknown(deadline=1.0, liveliness_lease_duration=3.0), unknown(deadline=2.0)
    (profile,) = intake_profiles("/t", [one, two])
    assert profile.deadline == Duration(seconds=2)
    assert profile.liveliness_lease_duration == Duration()
    (profile,) = intake_profiles("/t", [one, unknown(deadline=INFINITE)])
    assert profile.deadline == Duration()


@given(st.lists(OFFERS.map(lambda offer: mirror_offer("/t", offer)), min_size=1, max_size=4))
def test_the_mirror_of_several_publishers(offers: list[QoSProfile]) -> None:
    """Who matches one of the publishers matches their mirror, except for times that not all offer."""
    merged = merged_offer(offers)
    for offer in offers:
        request = QoSProfile(
            depth=1,
            reliability=offer.reliability,
            durability=offer.durability,
            liveliness=offer.liveliness,
        )
        assert not disagreements(merged, request)
        assert merged.depth >= offer.depth
    assert is_latched(merged) == any(map(is_latched, offers))


def test_a_subscription_without_publishers_requests_what_its_original_requests() -> None:
    """Only history and depth are the bridge's."""
    request = QoSProfile(depth=1, reliability=BEST_EFFORT, durability=LATCHED, deadline=2.0)
    mirror = mirror_request(request)
    assert kinds([mirror]) == [(BEST_EFFORT, LATCHED)]
    assert mirror.deadline == Duration(seconds=2)
