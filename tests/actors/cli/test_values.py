"""Types and values as they stand on a command line."""

from __future__ import annotations

import argparse
from typing import Any

import pytest

from actors.cli.errors import CommandError
from actors.cli.values import message_from_text, named_message, named_service, profile
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.geometry_msgs.msg import Twist
from actors.interfaces.std_msgs.msg import String
from actors.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy


def test_types_are_found_by_name() -> None:
    """Short or long."""
    assert named_message("std_msgs/String") is String
    assert named_service("example_interfaces/srv/AddTwoInts") is AddTwoInts


def test_a_type_of_the_wrong_kind_is_named() -> None:
    """A topic has a message type, a service a service type."""
    with pytest.raises(CommandError, match="'std_srvs/srv/Empty' is not a message type; write one such as"):
        named_message("std_srvs/srv/Empty")
    with pytest.raises(CommandError, match="'std_msgs/msg/String' is not a service type; write one such as"):
        named_service("std_msgs/msg/String")


@pytest.mark.parametrize("text", ["", "{}", "# nothing"])
def test_nothing_means_defaults(text: str) -> None:
    """An empty text is an empty map."""
    assert message_from_text(String, text) == String()


def test_values_are_yaml() -> None:
    """Also nested, and in either style."""
    assert message_from_text(String, "data: hello") == String(data="hello")
    assert message_from_text(Twist, "{linear: {x: 2.0}}").linear.x == 2.0


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{daata: x}", "no field 'daata'"),
        ("{data: [1]}", "data: "),
        ("hello", "must be a YAML map such as '{data: hello}', got: hello"),
        ("[1, 2]", "must be a YAML map"),
        ("{data: ", "not YAML"),
        ("{data: \x07}", "not YAML"),
        ("{data: 2020-99-99}", "not YAML"),
        ("!!python/object:os.system {}", "not YAML"),
    ],
)
def test_wrong_values_say_why(text: str, reason: str) -> None:
    """In one line."""
    with pytest.raises(CommandError) as failure:
        message_from_text(String, text)
    assert reason in str(failure.value)
    assert "\n" not in str(failure.value)


def test_qos_options_go_before_the_default() -> None:
    """What is not said stays."""
    options: dict[str, Any] = {"qos_depth": 3, "qos_history": None, "qos_reliability": "best_effort"}
    made = profile(argparse.Namespace(**options, qos_durability="transient_local"), QoSProfile(depth=10))
    assert made == QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=3,
        reliability=ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )
