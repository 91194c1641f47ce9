"""QoS overriding options: parameters decide the policies of publishers and subscriptions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.interfaces.std_msgs.msg import String
from actors.ros.rclpy.exceptions import InvalidParameterValueException
from actors.ros.rclpy.node import Node
from actors.ros.rclpy.parameter import Parameter
from actors.ros.rclpy.qos import QoSProfile, ReliabilityPolicy
from actors.ros.rclpy.qos_overriding_options import (
    InvalidQosOverridesError,
    QosCallbackResult,
    QoSOverridingOptions,
    QoSPolicyKind,
)
from actors.time.types import Duration

if TYPE_CHECKING:
    from actors.ros.rclpy.context import Context


def test_parameters_override_the_code(context: Context) -> None:
    """An override wins over the profile; the rest of it is declared as it is, for the remapped topic."""
    node = Node(
        "node",
        context=context,
        cli_args=["--ros-args", "-r", "chatter:=news", "-p", "qos_overrides./news.subscription.depth:=7"],
        parameter_overrides=[Parameter("qos_overrides./news.publisher_a.reliability", value="best_effort")],
    )
    options = QoSOverridingOptions.with_default_policies(entity_id="a")
    publisher = node.create_publisher(String, "chatter", 10, qos_overriding_options=options)
    assert (publisher.qos_profile.depth, publisher.qos_profile.reliability) == (
        10,
        ReliabilityPolicy.BEST_EFFORT,
    )
    subscription = node.create_subscription(
        String,
        "chatter",
        print,
        10,
        qos_overriding_options=QoSOverridingOptions([QoSPolicyKind.DEPTH, QoSPolicyKind.LIFESPAN]),
    )
    assert subscription.qos_profile.depth == 7
    declared = {name: each.value for name, each in node.get_parameters_by_prefix("qos_overrides").items()}
    assert declared == {
        "/news.publisher_a.history": "keep_last",
        "/news.publisher_a.depth": 10,
        "/news.publisher_a.reliability": "best_effort",
        "/news.subscription.depth": 7,
    }
    (info,) = node.get_publishers_info_by_topic("/news")
    assert info.qos_profile.reliability is ReliabilityPolicy.BEST_EFFORT
    (result,) = node.set_parameters([Parameter("qos_overrides./news.subscription.depth", value=8)])
    assert not result.successful


def test_a_callback_decides(context: Context) -> None:
    """The callback gets the resulting profile of rclpy, and may refuse it with a reason."""
    node = Node("node", context=context)
    seen = list[QoSProfile]()

    def decide(profile: QoSProfile) -> QosCallbackResult:
        seen.append(profile)
        return QosCallbackResult(successful=profile.depth > 5, reason="too shallow")

    options = QoSOverridingOptions([QoSPolicyKind.DEADLINE, QoSPolicyKind.DEPTH], callback=decide)
    assert (list(options.policy_kinds), options.callback, options.entity_id) == (
        [QoSPolicyKind.DEADLINE, QoSPolicyKind.DEPTH],
        decide,
        None,
    )
    profile = QoSProfile(depth=10, deadline=Duration(seconds=2))
    node.create_publisher(String, "a", profile, qos_overriding_options=options)
    assert seen == [profile]
    assert node.get_parameter("qos_overrides./a.publisher.deadline").value == 2_000_000_000
    with pytest.raises(InvalidQosOverridesError, match="publisher '/b' are not valid: too shallow"):
        node.create_publisher(String, "b", 1, qos_overriding_options=options)


def test_unknown_policies_are_refused(context: Context) -> None:
    """An override that names no policy is an error that names the parameter."""
    node = Node(
        "node",
        context=context,
        parameter_overrides=[Parameter("qos_overrides./a.publisher.history", value="keep_some")],
    )
    with pytest.raises(InvalidParameterValueException, match=r"qos_overrides\./a\.publisher\.history"):
        node.create_publisher(
            String, "a", 10, qos_overriding_options=QoSOverridingOptions.with_default_policies()
        )
