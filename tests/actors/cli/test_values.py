"""Types and values as they stand on a command line."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from actors.cli.errors import CommandError
from actors.cli.parsing import QOS_PRESETS, Parser, add_qos_options
from actors.cli.values import message_from_text, named_message, named_service, profile
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.geometry_msgs.msg import Twist
from actors.interfaces.std_msgs.msg import Bool, Byte, Float64, Int32, String, UInt64
from actors.qos.profile import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSPresetProfiles,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)
from actors.time.types import Duration


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
    ("msg_type", "text", "value"),
    [
        *(
            (String, each, each)
            for each in ("on", "010", "1e3", "12:30", "2020-01-01", "null", "~", "y", "1.0")
        ),
        *((String, f"'{each}'", each) for each in ("on", "1", "")),
        *((Bool, each, True) for each in ("on", "y", "1", "True")),
        *((Bool, each, False) for each in ("off", "n", "0", "False")),
        *((Int32, each, 8) for each in ("8", "010", "08", "0x8", "8.0", "0b1000", "8e0")),
        *((Float64, each, 1000.0) for each in ("1000", "1e3", "1_000", "0x3e8", "1.0e+3", "'1e3'")),
        *((Float64, each, -math.inf) for each in ("-.inf", "-inf", "'-Infinity'")),
        (UInt64, "18446744073709551615", 2**64 - 1),
        *((Byte, each, each.strip("'").encode()) for each in ("y", "a", "'1'")),
        (Byte, "1", b"\1"),
    ],
)
def test_a_value_is_what_the_type_of_its_field_says(msg_type: Any, text: str, value: object) -> None:
    """ROS 2's `topic pub` decides first, and then publishes "True", "8", "750" and true for `n`."""
    made = message_from_text(msg_type, f"{{data: {text}}}")
    assert (made.data, type(made.data)) == (value, type(value))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{daata: x}", "no field 'daata'"),
        ("{data: [1]}", "data: "),
        ("hello", "must be a YAML map such as '{data: hello}', got: hello"),
        ("[1, 2]", "must be a YAML map"),
        ("{data: ", "not YAML"),
        ("{data: \x07}", "not YAML"),
        ("!!python/object:os.system {}", "not YAML"),
        ("null", "must be a YAML map"),
    ],
)
def test_wrong_values_say_why(text: str, reason: str) -> None:
    """In one line."""
    with pytest.raises(CommandError) as failure:
        message_from_text(String, text)
    assert reason in str(failure.value)
    assert "\n" not in str(failure.value)


@pytest.mark.parametrize(
    ("msg_type", "text"), [(Int32, "y"), (Int32, "x"), (Bool, "maybe"), (Byte, "no one")]
)
def test_a_text_that_its_field_cannot_have(msg_type: Any, text: str) -> None:
    """It is named as the string that it is, and no other value is made of it."""
    with pytest.raises(CommandError, match=r"data: Expected (int|bool), got str|an integer from 0 to 255"):
        message_from_text(msg_type, f"{{data: {text}}}")


def asked(options: str, default: QoSProfile) -> QoSProfile:
    """Return the profile that a command line asks for."""
    parser = Parser()
    add_qos_options(parser)
    return profile(parser.parse_args(options.split()), default)


def test_qos_presets_go_before_the_default_and_single_policies_before_both() -> None:
    """As ROS 2 has it."""
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    assert asked("", latched) == latched
    assert asked("--qos-profile sensor_data", latched) == qos_profile_sensor_data
    mixed = asked("--qos-profile sensor_data --qos-depth 7 --qos-liveliness manual_by_topic", latched)
    assert mixed == replace(qos_profile_sensor_data, depth=7, liveliness=LivelinessPolicy.MANUAL_BY_TOPIC)
    assert asked("--qos-depth 0 --qos-history unknown", latched) == latched  # as the profile says
    leased = asked("--qos-liveliness-lease-duration-seconds 2.5", latched)
    assert leased == replace(latched, liveliness_lease_duration=Duration(seconds=2.5))


def test_every_preset_can_be_asked_for() -> None:
    """All but the one that stands for what is not known."""
    assert {*QOS_PRESETS, "unknown"} == set(QoSPresetProfiles.short_keys())


def test_qos_options_go_before_the_default() -> None:
    """What is not said stays."""
    options = "--qos-depth 3 --qos-reliability best_effort --qos-durability transient_local"
    made = asked(options, QoSProfile(depth=10))
    assert made == QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=3,
        reliability=ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )


@pytest.mark.parametrize(
    "text",
    ["x" * 3_000_000, "{data: [" + "1," * 10_000 + "]}", f"{{? {'k' * 100_000} : 1}}"],
    ids=["text", "list", "key"],
)
def test_errors_do_not_repeat_their_input(text: str) -> None:
    """A line of it is enough, however long it is."""
    with pytest.raises(CommandError) as caught:
        message_from_text(String, text)
    assert len(str(caught.value)) < 1000
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("opening", ["[", "- ", "{a: "])
def test_endless_nesting_is_reported(opening: str) -> None:
    """It does not crash what reads it."""
    with pytest.raises(CommandError, match="line 1: it is nested deeper than 100"):
        message_from_text(String, opening * 100_000)


def test_aliases_cannot_explode() -> None:
    """Case 59: a few hundred characters that stand for millions of values are refused at once."""
    lists = [f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]" for n in range(1, 40)]
    with pytest.raises(CommandError, match=r"not YAML: line [0-9]+: aliases add more than 100000 values"):
        message_from_text(String, "\n".join(["a0: &a0 [x, x]", *lists]))
