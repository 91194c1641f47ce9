"""The QoS that the player's publishers offer."""

from __future__ import annotations

from itertools import combinations

import pytest

from actors.bags.player.playing_qos import MAX_DEPTH, playing_qos
from actors.qos.compatibility import QoSCompatibility, qos_check_compatible
from actors.qos.profile import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from actors.time.types import Duration

OFFERS = [
    QoSProfile(depth=3),
    QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT),
    QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL),
    QoSProfile(depth=7, deadline=Duration(seconds=2)),
    QoSProfile(
        depth=1,
        liveliness=LivelinessPolicy.MANUAL_BY_TOPIC,
        liveliness_lease_duration=Duration(seconds=1),
    ),
]


@pytest.mark.parametrize("offer", OFFERS)
def test_one_offer_is_offered_again(offer: QoSProfile) -> None:
    """The recorded profile is offered unchanged."""
    assert playing_qos([offer]) == offer


@pytest.mark.parametrize("pair", list(combinations(OFFERS, 2)))
def test_what_fitted_one_of_them_fits(pair: tuple[QoSProfile, QoSProfile]) -> None:
    """A subscription that matched one of the recorded publishers matches the player's."""
    offered = playing_qos(pair)
    for requested in pair:
        assert qos_check_compatible(offered, requested)[0] is not QoSCompatibility.ERROR


def test_depths() -> None:
    """Depths of latched topics are added up, up to a limit."""
    latched = OFFERS[2]
    assert playing_qos([latched, latched, OFFERS[3]]).depth == 2
    assert playing_qos([OFFERS[0], OFFERS[1]]).depth == 5
    assert playing_qos([QoSProfile(depth=1_000_000)]).depth == MAX_DEPTH
    assert playing_qos([]).depth == 10
    keep_all = QoSProfile(history=HistoryPolicy.KEEP_ALL)
    assert playing_qos([OFFERS[0], keep_all]).history is HistoryPolicy.KEEP_ALL


def test_there_is_no_lifespan() -> None:
    """Messages keep their publish times, and would have expired."""
    assert playing_qos([QoSProfile(depth=1, lifespan=Duration(seconds=1))]) == QoSProfile(depth=1)
