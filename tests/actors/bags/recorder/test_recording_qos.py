"""The QoS of the recorder's subscriptions."""

from __future__ import annotations

import pytest

from actors.bags.recorder.recording_qos import DEPTH, recording_qos, unheard
from actors.qos.profile import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

RELIABLE = QoSProfile(depth=1)
BEST_EFFORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.mark.parametrize(
    ("offers", "reliable", "latched"),
    [
        ([], False, False),
        ([RELIABLE], True, False),
        ([RELIABLE, BEST_EFFORT], False, False),
        ([BEST_EFFORT], False, False),
        ([LATCHED], True, True),
        ([LATCHED, LATCHED], True, True),
        ([LATCHED, RELIABLE], True, False),
        ([LATCHED, BEST_EFFORT], False, False),
    ],
)
def test_a_subscription_requests_what_all_offer(
    offers: list[QoSProfile], *, reliable: bool, latched: bool
) -> None:
    """Reliable and latched only if every publisher is, as in ROS 2, so that all strict ones match."""
    qos = recording_qos((each, True) for each in offers)
    assert qos.reliability is (ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT)
    assert qos.durability is (DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE)
    assert (qos.history, qos.depth) == (HistoryPolicy.KEEP_LAST, DEPTH)
    assert not unheard([(each, True) for each in offers], qos)


def test_lossless_recording_holds_publishers_back() -> None:
    """KEEP_ALL and reliable, also with best-effort publishers, unless a strict one would not match."""
    qos = recording_qos([(RELIABLE, True), (BEST_EFFORT, False)], lossless=True)
    assert (qos.history, qos.reliability) == (HistoryPolicy.KEEP_ALL, ReliabilityPolicy.RELIABLE)
    qos = recording_qos([(BEST_EFFORT, True)], lossless=True)
    assert qos.reliability is ReliabilityPolicy.BEST_EFFORT


def test_strict_publishers_that_do_not_match_are_named() -> None:
    """A later, strict publisher does not match; others do, whatever they offer."""
    latched = recording_qos([(LATCHED, True)])
    assert "transient local" in unheard([(LATCHED, True), (RELIABLE, True)], latched).lower()
    assert not unheard([(LATCHED, True), (RELIABLE, False)], latched)
