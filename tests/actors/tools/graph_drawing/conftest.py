"""Graphs to draw, written as text, and the drawings that they are to give."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from actors.graph.snapshot import GraphSnapshot
from proto.wire.codes import EntryKind
from proto.wire.frames import GraphEntry

if TYPE_CHECKING:
    from collections.abc import Callable

GOLDEN = Path(__file__).parent / "golden"
KINDS = {
    ">": EntryKind.PUBLISHER,
    "<": EntryKind.SUBSCRIPTION,
    "?": EntryKind.CLIENT,
    "!": EntryKind.SERVICE,
}
TYPES = {
    EntryKind.PUBLISHER: "example_msgs/msg/Message",
    EntryKind.SUBSCRIPTION: "example_msgs/msg/Message",
    EntryKind.CLIENT: "example_msgs/srv/Call",
    EntryKind.SERVICE: "example_msgs/srv/Call",
}
GRAPHS = {
    "course": """
        /minimal_publisher >/addison
        /minimal_subscriber </addison2 </addison
        /publishing_subscriber </addison >/addison2
        /add_two_ints_client ?/add_two_ints
        /add_two_ints_server !/add_two_ints
    """,
    "circle": """
        /a >/x </z
        /b </x >/y
        /c </y >/z
        /pingpong >/ball </ball
    """,
    "robot": """
        /camera >/image_raw >/camera_info
        /rectify </image_raw </camera_info >/image_rect
        /detector </image_rect >/detections ?/get_model
        /model_server !/get_model
        /lidar >/scan
        /slam </scan </odom >/map >/tf
        /wheel_odometry >/odom </joint_states
        /base_controller </cmd_vel >/joint_states
        /planner </map </goal </detections >/path ?/make_plan
        /plan_server !/make_plan
        /follower </path </odom </scan >/cmd_vel
        /ui >/goal </map </image_rect >/cmd_vel
        /logger
        /watchdog
    """,
    "mismatches": """
        /a >/x
        /b </x:std_msgs/msg/Int32
        /c </x
        /cli ?/s:std_srvs/srv/Empty
        /srv !/s
    """,
    "empty": "",
}


def snapshot(text: str) -> GraphSnapshot:
    """Return a graph: a line for each node, with >topic, <topic, ?called and !served.

    A type may follow, as in >topic:std_msgs/msg/String.
    """
    result = GraphSnapshot()
    for line in text.strip().splitlines():
        node, *endpoints = line.split()
        _add(result, EntryKind.NODE, node, "", "")
        for endpoint in endpoints:
            kind = KINDS[endpoint[0]]
            name, _, type_name = endpoint[1:].partition(":")
            _add(result, kind, node, name, type_name or TYPES[kind])
    return result


def _add(result: GraphSnapshot, kind: EntryKind, node: str, name: str, type_name: str) -> None:
    key = len(result.entries) + 1
    result.entries[key] = GraphEntry(key, kind, node, name, type_name, "", {})


@pytest.fixture
def graph() -> Callable[[str], GraphSnapshot]:
    """Make a graph of a name or of a text."""
    return lambda text: snapshot(GRAPHS.get(text, text))


@pytest.fixture
def golden() -> Callable[[str], str]:
    """Return a drawing as it is to be."""
    return lambda name: (GOLDEN / name).read_text(encoding="utf-8").removesuffix("\n")
