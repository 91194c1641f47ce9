"""Message types as rosapi describes them."""

from __future__ import annotations

import msgspec

import actors
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.diagnostic_msgs.msg import DiagnosticStatus
from actors.interfaces.geometry_msgs.msg import PoseWithCovariance
from actors.interfaces.std_msgs.msg import Header
from actors.web.rosbridge.type_definitions import type_definitions


def test_a_type_and_what_it_contains() -> None:
    """Each type once, by names of ROS 1."""
    assert [each["type"] for each in type_definitions(Header)] == [
        "std_msgs/Header",
        "builtin_interfaces/Time",
    ]
    assert type_definitions(Time) == [
        {
            "type": "builtin_interfaces/Time",
            "fieldnames": ["sec", "nanosec"],
            "fieldtypes": ["int32", "uint32"],
            "fieldarraylen": [-1, -1],
            "examples": ["0", "0"],
            "constnames": [],
            "constvalues": [],
        }
    ]


def test_sequences_have_lengths_and_constants_have_values() -> None:
    """A fixed array its own, a sequence 0."""
    first = type_definitions(PoseWithCovariance)[0]
    assert first["fieldtypes"] == ["geometry_msgs/Pose", "float64"]
    assert (first["fieldarraylen"], first["examples"]) == ([-1, 36], ["{}", "[]"])
    status = type_definitions(DiagnosticStatus)[0]
    assert status["fieldarraylen"] == [-1, -1, -1, -1, 0]
    assert dict(zip(status["constnames"], status["constvalues"], strict=True))["STALE"] == "3"


class Tree(actors.Message, type_name="rosbridge_test/msg/Tree"):
    """A type that contains itself."""

    branches: list[Tree] = msgspec.field(default_factory=list["Tree"])


def test_a_type_that_contains_itself() -> None:
    """Is described once."""
    assert [each["type"] for each in type_definitions(Tree)] == ["rosbridge_test/Tree"]
