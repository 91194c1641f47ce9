"""The bridge's types, in a process that has rclpy and callboard."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.interfaces.message import type_hash
from actors.interfaces.std_srvs.srv import SetBool

if TYPE_CHECKING:
    from tests.real_ros.sides import Side

BOOL = "std_srvs/srv/SetBool"


def test_every_type_of_real_ros_2_is_known_with_one_hash(real: Side) -> None:
    """Messages, services and actions, their parts and their events."""
    assert real.call("bridge_types.of_other_hashes") == []


def test_messages_are_the_same_on_the_way_back(real: Side) -> None:
    """All of ROS 2's own test messages, and what a large array dominates."""
    assert real.call("bridge_types.not_crossed") == []
    assert real.call("bridge_types.large_image") is True


def test_services_have_both_ends_classes(real: Side) -> None:
    """Requests and responses become messages, and rclpy's objects again; parts of actions, too."""
    assert real.call("bridge_types.service_objects") == [
        f"{BOOL} SetBool_Request",
        f"{BOOL} SetBool_Response",
        "test_msgs/action/Fibonacci_GetResult Fibonacci_GetResult_Request",
        "test_msgs/action/Fibonacci_GetResult Fibonacci_GetResult_Response",
    ]


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("no_pkg/msg/X", "ROS 2 has no package no_pkg: install it (apt: ros-DISTRO-no-pkg,"),
        ("std_msgs/msg/Nope", "the package std_msgs of ROS 2 has no msg/Nope: install another"),
        ("std_msgs/msg/String_Goal", "'std_msgs/msg/String_Goal' is not the name of a type"),
        ("../msg/X", "'../msg/X' is not the name of a type, such as std_msgs/msg/String"),
        ("json/msg/X", "ROS 2 has no package json"),  # Python's
    ],
)
def test_what_cannot_cross_has_a_reason(real: Side, name: str, reason: str) -> None:
    """Names come from other machines: any text."""
    known = real.call("bridge_types.known", name)
    assert known["reason"].startswith(reason)
    assert not known["theirs"]
    assert real.call("bridge_types.refused", "message", name) == known["reason"]


def test_kinds_are_not_mixed_up(real: Side) -> None:
    """A service is no message."""
    assert real.call("bridge_types.refused", "message", BOOL) == f"'{BOOL}' is no message type"
    assert "is no service type" in real.call("bridge_types.refused", "service", "std_msgs/msg/String")


def test_an_endpoint_of_another_definition_is_named_with_both_hashes(real: Side) -> None:
    """Endpoints of a service have the hash of its request; an unknown one says nothing."""
    own = type_hash(SetBool.Request)
    assert real.call("bridge_types.known", BOOL)["our_request_hash"] == own
    for same in (own, ""):
        assert real.call("bridge_types.difference", BOOL, same) == ""
    text = real.call("bridge_types.difference", BOOL, "RIHS01_other")
    assert own in text
    assert "RIHS01_other" in text
