"""Which pairs of profiles fit, with rclpy's verdicts and texts."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest
from hypothesis import given

from actors.qos.compatibility import (
    QoSCompatibility,
    QoSPolicyKind,
    disagreements,
    qos_check_compatible,
)
from actors.qos.profile import DurabilityPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy
from proto.wire.codes import PolicyKind
from proto.wire.qos import incompatible_policy, parse_qos
from tests.actors.qos.test_profile import PROFILES


def incompatible_policies(pub: QoSProfile, sub: QoSProfile) -> tuple[QoSPolicyKind, ...]:
    return tuple(kind for kind, _ in disagreements(pub, sub))


def _is_half_open(profile: QoSProfile) -> bool:
    """Whether something is left to the system, so that nobody can tell what it is."""
    policies = (profile.reliability, profile.durability, profile.liveliness)
    return any(policy.name in {"SYSTEM_DEFAULT", "UNKNOWN"} for policy in policies)


def test_best_effort_publisher_and_reliable_subscription() -> None:
    """The reason says which side is what, and the policy can be named."""
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    reliable = QoSProfile(depth=1)
    assert qos_check_compatible(best_effort, reliable) == (
        QoSCompatibility.ERROR,
        "ERROR: Best effort publisher and reliable subscription;",
    )
    assert incompatible_policies(best_effort, reliable) == (QoSPolicyKind.RELIABILITY,)
    assert qos_check_compatible(reliable, best_effort) == (QoSCompatibility.OK, "")
    assert incompatible_policies(reliable, best_effort) == ()


def test_durability_pairs() -> None:
    """Only a volatile publisher with a transient local subscription is an error."""
    volatile = QoSProfile(depth=1)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    assert qos_check_compatible(volatile, latched) == (
        QoSCompatibility.ERROR,
        "ERROR: Volatile publisher and transient local subscription;",
    )
    assert incompatible_policies(volatile, latched) == (QoSPolicyKind.DURABILITY,)
    for pub, sub in ((volatile, volatile), (latched, volatile), (latched, latched)):
        assert qos_check_compatible(pub, sub)[0] is QoSCompatibility.OK


def test_both_errors_are_reported_and_hide_warnings() -> None:
    """Several errors are listed, DURABILITY last; a warning shows only without an error."""
    weak = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    strong = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    verdict, reason = qos_check_compatible(weak, strong)
    assert verdict is QoSCompatibility.ERROR
    assert reason.count("ERROR: ") == 2
    assert incompatible_policies(weak, strong)[-1] is QoSPolicyKind.DURABILITY
    half_open = dataclasses.replace(strong, reliability=ReliabilityPolicy.SYSTEM_DEFAULT)
    assert "WARNING" not in qos_check_compatible(weak, half_open)[1]


@pytest.mark.parametrize(
    ("pub", "sub", "reason"),
    [
        ({"reliability": 0}, {"reliability": 1}, "Reliable subscription, but publisher is system_default"),
        ({"reliability": 2}, {"reliability": 3}, "Best effort publisher, but subscription is unknown"),
        (
            {"reliability": 0},
            {"reliability": 3},
            "Publisher reliability is system_default and subscription reliability is unknown",
        ),
        (
            {"durability": 0},
            {"durability": 1},
            "Transient local subscription, but publisher is system_default",
        ),
        ({"durability": 2}, {"durability": 0}, "Volatile publisher, but subscription is system_default"),
        (
            {"durability": 3},
            {"durability": 0},
            "Publisher durability is unknown and subscription durability is system_default",
        ),
    ],
)
def test_open_policies_warn(pub: dict[str, int], sub: dict[str, int], reason: str) -> None:
    """A policy that a side leaves open is a warning that says so."""
    verdict = qos_check_compatible(QoSProfile(depth=1, **pub), QoSProfile(depth=1, **sub))
    assert verdict == (QoSCompatibility.WARNING, f"WARNING: {reason};")


@given(PROFILES)
def test_a_resolved_profile_fits_itself(profile: QoSProfile) -> None:
    """Identical profiles with nothing left open are OK without a reason."""
    fixed = profile.resolved()
    assert qos_check_compatible(fixed, fixed) == (QoSCompatibility.OK, "")
    assert fixed.resolved() == fixed


@pytest.mark.parametrize(
    ("pub", "sub", "kind"),
    [
        ({}, {"deadline": 1}, QoSPolicyKind.DEADLINE),
        ({"deadline": 2}, {"deadline": 1}, QoSPolicyKind.DEADLINE),
        ({"deadline": 1}, {"deadline": 1}, None),
        ({"deadline": 1}, {}, None),
        ({}, {"liveliness_lease_duration": 1}, QoSPolicyKind.LIVELINESS_LEASE_DURATION),
        (
            {"liveliness_lease_duration": 2},
            {"liveliness_lease_duration": 1},
            QoSPolicyKind.LIVELINESS_LEASE_DURATION,
        ),
        ({"liveliness_lease_duration": 1}, {"liveliness_lease_duration": 2}, None),
        ({}, {"liveliness": LivelinessPolicy.MANUAL_BY_TOPIC}, QoSPolicyKind.LIVELINESS),
        ({"liveliness": LivelinessPolicy.MANUAL_BY_TOPIC}, {}, None),
        ({"lifespan": 1}, {"lifespan": 2}, None),
    ],
)
def test_times_and_liveliness(pub: dict[str, Any], sub: dict[str, Any], kind: QoSPolicyKind | None) -> None:
    """A subscription may not want it sooner, nor by hand, than the publisher says."""
    profiles = QoSProfile(depth=1, **pub), QoSProfile(depth=1, **sub)
    verdict, reason = qos_check_compatible(*profiles)
    assert verdict is (QoSCompatibility.OK if kind is None else QoSCompatibility.ERROR)
    assert incompatible_policies(*profiles) == (() if kind is None else (kind,))
    assert bool(reason) == (kind is not None)


@given(PROFILES, PROFILES)
def test_the_broker_agrees(pub: QoSProfile, sub: QoSProfile) -> None:
    """The broker names the last of the policies that the check finds, if nothing is left open."""
    if "WARNING" in qos_check_compatible(pub, sub)[1] or _is_half_open(pub) or _is_half_open(sub):
        pub, sub = pub.resolved(), sub.resolved()
    found = incompatible_policies(pub, sub)
    named = incompatible_policy(parse_qos(pub.to_wire()), parse_qos(sub.to_wire()))
    assert named == (PolicyKind(found[-1]) if found else None)
