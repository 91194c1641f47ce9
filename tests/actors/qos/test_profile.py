"""QoS profiles: rclpy's numbers, defaults and presets, and the wire form."""

from __future__ import annotations

import dataclasses
import warnings
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.qos.profile import (
    DurabilityPolicy,
    HistoryPolicy,
    InvalidQoSProfileError,
    LivelinessPolicy,
    QoSPresetProfiles,
    QoSProfile,
    ReliabilityPolicy,
    qos_from,
    qos_profile_action_status_default,
    qos_profile_best_available,
    qos_profile_default,
    qos_profile_parameter_events,
    qos_profile_parameters,
    qos_profile_rosout_default,
    qos_profile_sensor_data,
    qos_profile_services_default,
    qos_profile_system_default,
    qos_profile_unknown,
)
from actors.time.types import INFINITE, Duration
from proto.limits import MAX_DEPTH
from proto.wire.qos import DEFAULT_DEPTH

TIMES = st.one_of(
    st.just(INFINITE),
    st.integers(0, 2**62).map(lambda number: Duration(nanoseconds=number)),
    st.floats(0, 1e9),
)
PROFILES = st.builds(
    QoSProfile,
    history=st.sampled_from(HistoryPolicy),
    depth=st.integers(1, MAX_DEPTH),
    reliability=st.sampled_from(ReliabilityPolicy),
    durability=st.sampled_from(DurabilityPolicy),
    deadline=TIMES,
    lifespan=TIMES,
    liveliness=st.sampled_from(LivelinessPolicy),
    liveliness_lease_duration=TIMES,
)


def test_an_int_is_keep_last_with_that_depth() -> None:
    """An int means KEEP_LAST; a profile is returned as it is."""
    assert qos_from(7) == QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=7)
    assert qos_from(qos_profile_sensor_data) is qos_profile_sensor_data


def test_bad_qos_argument() -> None:
    """A negative depth and a foreign type have rclpy's texts."""
    with pytest.raises(ValueError, match="greater than or equal to zero"):
        qos_from(-1)
    for value in ("foo", None, True, 1.0):
        wrong: Any = value
        with pytest.raises(TypeError, match="Expected QoSProfile or int, but received <class"):
            qos_from(wrong)


def test_history_or_depth_is_required() -> None:
    """A profile with neither, and KEEP_LAST without a depth, are invalid."""
    with pytest.raises(InvalidQoSProfileError, match="History and/or depth settings are required"):
        QoSProfile()
    with pytest.raises(InvalidQoSProfileError, match="KEEP_LAST without a depth"):
        QoSProfile(history=HistoryPolicy.KEEP_LAST)
    assert QoSProfile(history=HistoryPolicy.KEEP_ALL).depth == DEFAULT_DEPTH


def test_depth_alone_is_keep_last() -> None:
    """A depth alone means KEEP_LAST, reliable and volatile."""
    profile = QoSProfile(depth=1)
    assert profile.history is HistoryPolicy.KEEP_LAST
    assert profile.reliability is ReliabilityPolicy.RELIABLE
    assert profile.durability is DurabilityPolicy.VOLATILE


def test_depth_zero_warns_once() -> None:
    """KEEP_LAST with depth 0 warns once at the caller's line and resolves to the default depth."""
    with pytest.warns(UserWarning, match="can keep no message") as caught:
        profile = QoSProfile(depth=0)
    assert [warning.filename for warning in caught] == [__file__]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert profile.resolved().depth == DEFAULT_DEPTH
        assert QoSProfile(history=HistoryPolicy.KEEP_ALL, depth=0).depth == 0


@pytest.mark.parametrize("depth", [-1, MAX_DEPTH + 1, 1 << 70])
def test_depth_out_of_range(depth: int) -> None:
    """A depth is 0 to MAX_DEPTH."""
    with pytest.raises(InvalidQoSProfileError, match="depth must be"):
        QoSProfile(depth=depth)


@pytest.mark.parametrize(
    "options",
    [
        {"depth": "1"},
        {"depth": True},
        {"depth": 1, "history": "keep_last"},
        {"depth": 1, "history": ReliabilityPolicy.RELIABLE},
        {"depth": 1, "deadline": "1"},
        {"depth": 1, "lifespan": True},
        {"depth": 1, "liveliness": HistoryPolicy.KEEP_ALL},
        {"depth": 1, "liveliness_lease_duration": None},
        {"depth": 1, "lease": 1},
    ],
)
def test_wrong_types_and_options(options: dict[str, Any]) -> None:
    """Another type, another policy's value and an option that nothing implements are TypeErrors."""
    with pytest.raises(TypeError):
        QoSProfile(**options)


def test_policy_numbers() -> None:
    """The numbers are rclpy's, and a profile accepts them."""
    assert {policy.name: int(policy) for policy in HistoryPolicy} == {
        "SYSTEM_DEFAULT": 0,
        "KEEP_LAST": 1,
        "KEEP_ALL": 2,
        "UNKNOWN": 3,
    }
    assert (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT) == (1, 2)
    assert (DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE) == (1, 2)
    assert (LivelinessPolicy.AUTOMATIC, LivelinessPolicy.MANUAL_BY_TOPIC) == (1, 3)
    assert (ReliabilityPolicy.BEST_AVAILABLE, DurabilityPolicy.BEST_AVAILABLE) == (4, 4)
    assert QoSProfile(history=2, reliability=2, durability=1) == QoSProfile(
        history=HistoryPolicy.KEEP_ALL,
        reliability=ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )
    with pytest.raises(InvalidQoSProfileError, match="9 is not the number of a HistoryPolicy"):
        QoSProfile(history=9)


def test_short_keys() -> None:
    """Short keys are lower case and found in any case; an unknown one lists the known."""
    assert HistoryPolicy.short_keys() == ["system_default", "keep_last", "keep_all", "unknown"]
    assert HistoryPolicy.get_from_short_key("KEEP_last") is HistoryPolicy.KEEP_LAST
    assert ReliabilityPolicy.BEST_EFFORT.short_key == "best_effort"
    assert DurabilityPolicy.get_from_short_key("transient_local") is DurabilityPolicy.TRANSIENT_LOCAL
    with pytest.raises(ValueError, match="'keep' is not one of system_default, keep_last"):
        HistoryPolicy.get_from_short_key("keep")


@pytest.mark.parametrize(
    ("profile", "depth", "reliability", "durability"),
    [
        (qos_profile_default, 10, "reliable", "volatile"),
        (qos_profile_sensor_data, 5, "best_effort", "volatile"),
        (qos_profile_services_default, 10, "reliable", "volatile"),
        (qos_profile_parameters, 1000, "reliable", "volatile"),
        (qos_profile_parameter_events, 1000, "reliable", "volatile"),
        (qos_profile_rosout_default, 1000, "reliable", "transient_local"),
        (qos_profile_action_status_default, 1, "reliable", "transient_local"),
        (qos_profile_system_default.resolved(), 10, "reliable", "volatile"),
        (qos_profile_unknown.resolved(), 10, "reliable", "volatile"),
        (qos_profile_best_available.resolved(), 10, "reliable", "volatile"),
    ],
)
def test_presets(profile: QoSProfile, depth: int, reliability: str, durability: str) -> None:
    """The presets have ROS 2's values, and what is left open resolves to the default profile's."""
    assert profile.history is HistoryPolicy.KEEP_LAST
    assert (profile.depth, profile.reliability.short_key, profile.durability.short_key) == (
        depth,
        reliability,
        durability,
    )


def test_presets_by_name() -> None:
    """The enum finds presets by short key, also where two are equal."""
    assert QoSPresetProfiles.SYSTEM_DEFAULT.value is qos_profile_system_default
    assert QoSPresetProfiles.get_from_short_key("Sensor_Data") is qos_profile_sensor_data
    assert {"parameters", "parameter_events", "default"} <= set(QoSPresetProfiles.short_keys())
    with pytest.raises(ValueError, match="not one of unknown, default"):
        QoSPresetProfiles.get_from_short_key("nothing")


def test_times() -> None:
    """Times are durations or seconds; zero and infinite ones are none, negative ones an error."""
    profile = QoSProfile(depth=1, deadline=0.5, lifespan=Duration(nanoseconds=7), liveliness_lease_duration=2)
    assert profile.deadline == Duration(seconds=0.5)
    assert profile.to_wire() == {
        **QoSProfile(depth=1).to_wire(),
        "deadline_ns": 500_000_000,
        "lifespan_ns": 7,
        "lease_ns": 2_000_000_000,
    }
    endless = QoSProfile(depth=1, deadline=INFINITE, lifespan=float("inf"), liveliness_lease_duration=0)
    assert endless.resolved() == QoSProfile(depth=1)
    assert qos_profile_rosout_default.lifespan == Duration(seconds=10)
    for wrong in (-1, -0.1, Duration(seconds=-1), 1e30, float("nan")):
        with pytest.raises(InvalidQoSProfileError, match="deadline"):
            QoSProfile(depth=1, deadline=wrong)


def test_profiles_are_values() -> None:
    """Profiles compare and hash by value, cannot be changed, and can be replaced."""
    profile = QoSProfile(depth=1)
    assert profile == QoSProfile(depth=1)
    assert len({profile, QoSProfile(depth=1), QoSProfile(depth=2)}) == 2
    with pytest.raises(dataclasses.FrozenInstanceError):
        profile.depth = 2  # type: ignore[misc]
    assert dataclasses.replace(profile, depth=2) == QoSProfile(depth=2)
    assert "depth=1" in repr(profile)


@given(PROFILES)
def test_wire_round_trip(profile: QoSProfile) -> None:
    """What goes on the wire is the resolved profile, and comes back as it."""
    fields = profile.to_wire()
    assert all(type(value) is int for value in fields.values())
    assert QoSProfile.from_wire({**fields, "later": [1, 2]}) == profile.resolved()


def test_wire_defaults() -> None:
    """Missing and nil fields are the default profile's."""
    assert QoSProfile.from_wire({}) == qos_profile_default
    assert QoSProfile.from_wire({"depth": None, "reliability": 2}) == QoSProfile(depth=10, reliability=2)


@pytest.mark.parametrize(
    "fields",
    [
        {"depth": -1},
        {"depth": 0},
        {"depth": MAX_DEPTH + 1},
        {"depth": "5"},
        {"depth": True},
        {"history": 99},
        {"reliability": 1.0},
        {"durability": b"\x01"},
        {"durability": []},
        {"liveliness": 2},
        {"deadline_ns": 0.5},
        {"lifespan_ns": -1},
        {"lease_ns": 2**70},
    ],
)
def test_wire_rejects(fields: dict[str, object]) -> None:
    """A foreign profile with a bad value is a ValueError, never a warning or another exception."""
    with pytest.raises(ValueError, match="Invalid QoSProfile"):
        QoSProfile.from_wire(fields)
