"""The QoS of the recorder's subscriptions."""

from __future__ import annotations

import pytest

from actors.bags.recorder.errors import InvalidRecordingError
from actors.bags.recorder.recording_qos import DEPTH, read_overrides, recording_qos, unheard
from actors.interfaces.yaml_reader import YamlError
from actors.qos.profile import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from actors.time.types import Duration

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
    """Reliable and latched only if every publisher is, as in ROS 2: so no strict one is missed."""
    qos = recording_qos((each, True) for each in offers)
    assert qos.reliability is (ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT)
    assert qos.durability is (DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE)
    assert (qos.history, qos.depth) == (HistoryPolicy.KEEP_LAST, DEPTH)
    assert not unheard([(each, True) for each in offers], qos)


def test_lossless_recording_holds_publishers_back() -> None:
    """KEEP_ALL and reliable, also beside best effort publishers, unless a strict one would not match."""
    qos = recording_qos([(RELIABLE, True), (BEST_EFFORT, False)], lossless=True)
    assert (qos.history, qos.reliability) == (HistoryPolicy.KEEP_ALL, ReliabilityPolicy.RELIABLE)
    qos = recording_qos([(BEST_EFFORT, True)], lossless=True)
    assert qos.reliability is ReliabilityPolicy.BEST_EFFORT


def test_strict_publishers_that_do_not_match_are_named() -> None:
    """A publisher that came later and is strict is not heard; others are, whatever they offer."""
    latched = recording_qos([(LATCHED, True)])
    assert "transient local" in unheard([(LATCHED, True), (RELIABLE, True)], latched).lower()
    assert not unheard([(LATCHED, True), (RELIABLE, False)], latched)


def test_overrides() -> None:
    """A file names topics with rclpy's policies; what it leaves out has the profile's default."""
    found = read_overrides(
        b"""
/imu:
  history: keep_all
  reliability: best_effort
/camera:
  history: keep_last
  depth: 7
  durability: transient_local
  liveliness: automatic
  deadline: {sec: 1, nsec: 500}
  avoid_ros_namespace_conventions: false
"""
    )
    assert found == {
        "/imu": QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.BEST_EFFORT),
        "/camera": QoSProfile(
            depth=7,
            durability=DurabilityPolicy.TRANSIENT_LOCAL,
            liveliness=LivelinessPolicy.AUTOMATIC,
            deadline=Duration(seconds=1, nanoseconds=500),
        ),
    }


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("- a", "Expected a mapping of topics"),
        ("imu: {depth: 1}", "full name of a topic"),
        ("/imu: 3", "/imu: expected a mapping"),
        ("/imu: {deepth: 1}", "no policy 'deepth'.*depth"),
        ("/imu: {reliability: sure}", "/imu: reliability: expected one of .*best_effort"),
        ("/imu: {reliability: 7}", "expected one of"),
        ("/imu: {depth: -1}", "/imu"),
        ("/imu: {depth: many}", "/imu"),
        ("/imu: {depth: 1, deadline: 3}", r"deadline: expected \{sec"),
        ("/imu: {depth: 1, deadline: {sec: -1, nsec: 0}}", "deadline"),
        ("/imu: {depth: 1, deadline: {sec: 1}}", "deadline"),
        ("/imu: {reliability: reliable}", "/imu: .*History"),
    ],
)
def test_wrong_overrides(text: str, error: str) -> None:
    """The error names the topic, the policy and what it may be."""
    with pytest.raises(InvalidRecordingError, match=error):
        read_overrides(text.encode())


def test_overrides_that_are_no_yaml() -> None:
    """The reader's error has the line."""
    with pytest.raises(YamlError):
        read_overrides(b"/imu: {")
