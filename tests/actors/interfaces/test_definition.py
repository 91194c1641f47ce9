"""Canonical definitions and RIHS01 hashes."""

# ruff: noqa: RUF012 - msgspec copies a default []

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Annotated

import pytest

from actors.interfaces import types
from actors.interfaces.message import Message, definition, type_hash
from actors.interfaces.registry import find_interface
from actors.interfaces.std_msgs.msg import Empty, String
from tests.interfaces.imported import TYPES

KNOWN: dict[str, str] = json.loads((Path(__file__).parent / "type_hashes.json").read_text())


@pytest.mark.parametrize("name", KNOWN)
def test_hashes_are_ros_2s(name: str) -> None:
    """The standard types hash as ROS 2's own do (Jazzy), so fields, order and types are the same.

    Those of rosbag2_interfaces are what ROS 2's generator makes of Kilted's definitions.
    """
    assert name in TYPES[name.partition("/")[0]]
    assert type_hash(find_interface(name)) == KNOWN[name]


def test_string() -> None:
    """The best-known hash, written out."""
    assert type_hash(String) == "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"


def test_the_hash_is_of_the_definition() -> None:
    """Another language gets the hash with SHA-256 alone."""
    assert type_hash(String) == "RIHS01_" + hashlib.sha256(definition(String)).hexdigest()


def test_an_empty_message_has_ros_2s_placeholder() -> None:
    """As in ROS, whose structures cannot be empty."""
    described = json.loads(definition(Empty))["type_description"]
    assert [field["name"] for field in described["fields"]] == ["structure_needs_at_least_one_member"]


class Plain(Message, type_name="a_msgs/msg/Both"):
    i: int = 0
    f: float = 0.0
    s: str = ""
    b: bool = False
    d: bytes = b""
    n: list[float] = []
    t: Annotated[list[str], types.AtMost(3)] = []


class Explicit(Message, type_name="a_msgs/msg/Both"):
    i: types.int64 = 0
    f: types.float64 = 1.0
    s: types.string = ""
    b: types.boolean = False
    d: types.UInt8Sequence = b""
    n: types.Float64Sequence = types.Float64Array()
    t: Annotated[list[types.string], types.AtMost(3)] = []


def test_plain_annotations_hash_like_the_ros_types() -> None:
    """int is int64, float is float64, bytes is uint8[]; defaults do not count."""
    assert type_hash(Plain) == type_hash(Explicit)


def test_bounds_count() -> None:
    """Each bound is part of the type."""

    class A(Message, type_name="a_msgs/msg/A"):
        x: Annotated[types.Float64Sequence, types.Length(3)] = types.Float64Array([0] * 3)

    class B(Message, type_name="a_msgs/msg/A"):
        x: Annotated[types.Float64Sequence, types.AtMost(3)] = types.Float64Array([0] * 3)

    field = json.loads(definition(A))["type_description"]["fields"][0]["type"]
    assert field == {"type_id": 59, "capacity": 3, "string_capacity": 0, "nested_type_name": ""}
    assert type_hash(A) != type_hash(B)
