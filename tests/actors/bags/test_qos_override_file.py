"""Files with the QoS of single topics."""

from __future__ import annotations

import pytest

from actors.bags.errors import InvalidBagOptionError
from actors.bags.qos_override_file import read_overrides
from actors.interfaces.yaml_reader import YamlError
from actors.qos.profile import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from actors.time.types import Duration


def test_overrides() -> None:
    """A file gives policies by topic, by their names in rclpy; others have the default of the profile."""
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
    """The error names the topic, the policy and the allowed values."""
    with pytest.raises(InvalidBagOptionError, match=error):
        read_overrides(text.encode())


def test_overrides_that_are_no_yaml() -> None:
    """The error of the YAML reader names the line."""
    with pytest.raises(YamlError):
        read_overrides(b"/imu: {")
