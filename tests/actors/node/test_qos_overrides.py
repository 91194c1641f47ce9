"""QoS of endpoints from parameters."""

from __future__ import annotations

from typing import Any

import pytest

import actors
from actors import DurabilityPolicy, QoSOverridingOptions, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from actors.interfaces.std_msgs.msg import String
from actors.parameters.errors import (
    InvalidParameterTypeError,
    InvalidParameterValueError,
    ParameterImmutableError,
)

PUBLISHER = "qos_overrides./ns/chatter.publisher"
SUBSCRIPTION = "qos_overrides./ns/chatter.subscription"
DEFAULT = QoSOverridingOptions.with_default_policies()


def node(**overrides: Any) -> actors.Node:
    return actors.Node("n", namespace="ns", use_global_arguments=False, parameter_overrides=overrides)


def test_only_what_the_options_name_is_overridden() -> None:
    """Depth and reliability by default; without options nothing, and no parameter is declared."""
    given = {f"{PUBLISHER}.depth": 3, f"{PUBLISHER}.reliability": "best_effort"}
    talker = node(**given, **{f"{PUBLISHER}.durability": "transient_local"})
    assert talker.create_publisher(String, "chatter", 10).qos_profile == QoSProfile(depth=10)
    assert not talker.has_parameter(f"{PUBLISHER}.depth")
    made = talker.create_publisher(String, "chatter", 10, qos_overriding_options=DEFAULT)
    assert made.qos_profile == QoSProfile(depth=3, reliability=ReliabilityPolicy.BEST_EFFORT)
    assert talker.get_parameter(f"{PUBLISHER}.history").value == "keep_last"
    with pytest.raises(ParameterImmutableError):
        talker.undeclare_parameter(f"{PUBLISHER}.depth")
    again = talker.create_publisher(String, "chatter", 7, qos_overriding_options=DEFAULT)
    assert again.qos_profile.depth == 3


def test_a_subscription_by_its_id() -> None:
    """The id tells two of a topic apart; times are nanoseconds; lifespan is a publisher's."""
    listener = node(**{f"{SUBSCRIPTION}_slow.deadline": 5_000_000_000, f"{SUBSCRIPTION}.depth": 2})
    kinds = (QoSPolicyKind.DEADLINE, QoSPolicyKind.DURABILITY, QoSPolicyKind.LIFESPAN)
    slow = listener.create_subscription(
        String, "chatter", print, 10, qos_overriding_options=QoSOverridingOptions(kinds, entity_id="slow")
    )
    assert slow.qos_profile == QoSProfile(depth=10, deadline=5.0)
    assert listener.get_parameter(f"{SUBSCRIPTION}_slow.durability").value == "volatile"
    assert not listener.has_parameter(f"{SUBSCRIPTION}_slow.lifespan")
    quick = listener.create_subscription(String, "chatter", print, 10, qos_overriding_options=DEFAULT)
    assert quick.qos_profile.depth == 2


@pytest.mark.parametrize(
    ("policy", "value", "error"),
    [
        ("reliability", "perhaps", InvalidParameterValueError),
        ("depth", "many", InvalidParameterTypeError),
        ("depth", -1, actors.InvalidQoSProfileError),
    ],
)
def test_an_override_that_is_no_policy(policy: str, value: Any, error: type[Exception]) -> None:
    """The error names the parameter, or the topic."""
    talker = node(**{f"{PUBLISHER}.{policy}": value})
    with pytest.raises(error, match=r"qos_overrides\./ns/chatter\.publisher") as caught:
        talker.create_publisher(String, "chatter", 10, qos_overriding_options=DEFAULT)
    assert str(caught.value).count("Invalid ") == 1


def test_a_callback_may_refuse() -> None:
    """The callback gets the profile with the overrides, and may refuse it."""

    def check(profile: QoSProfile) -> actors.SetParametersResult:
        kept = profile.durability is DurabilityPolicy.VOLATILE and profile.depth > 5
        return actors.SetParametersResult(successful=kept, reason="too shallow")

    options = QoSOverridingOptions.with_default_policies(callback=check)
    with pytest.raises(actors.InvalidQoSProfileError, match="too shallow"):
        node(**{f"{PUBLISHER}.depth": 1}).create_publisher(
            String, "chatter", 10, qos_overriding_options=options
        )
    made = node(**{f"{PUBLISHER}.depth": 9}).create_publisher(
        String, "chatter", 10, qos_overriding_options=options
    )
    assert made.qos_profile.depth == 9
