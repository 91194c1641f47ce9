"""Messages from and to plain values, by the names of ROS 2's package."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import pytest

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.geometry_msgs.msg import PoseArray, PoseStamped
from actors.interfaces.std_msgs.msg import Header, String
from actors.interfaces.std_srvs.srv import SetBool
from actors.ros import finder, rosidl_runtime_py
from actors.ros.rosidl_parser.definition import NamespacedType, UnboundedString
from actors.ros.rosidl_runtime_py import set_message_fields, utilities

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any


@pytest.fixture(autouse=True)
def _own_finder(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the test import by ROS 2's names."""
    monkeypatch.setattr(sys, "meta_path", [finder.RosFinder(), *sys.meta_path])


def test_interfaces_are_found_by_name() -> None:
    """Each by the function of its kind, or by one for all."""
    assert utilities.get_message("std_msgs/msg/String") is String
    assert utilities.get_service("std_srvs/srv/SetBool") is SetBool
    assert utilities.get_action("example_interfaces/action/Fibonacci") is Fibonacci
    assert utilities.get_interface("std_srvs/srv/SetBool") is SetBool
    assert rosidl_runtime_py.import_message_from_namespaced_type(Header.SLOT_TYPES[0]) is Time  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("get", "name", "error"),
    [
        (utilities.get_message, "std_msgs/String", ValueError),
        (utilities.get_message, "std_msgs//String", ValueError),
        (utilities.get_message, "std_srvs/srv/SetBool", ValueError),
        (utilities.get_service, "std_msgs/msg/String", ValueError),
        (utilities.get_action, "std_msgs/msg/String", ValueError),
        (utilities.get_message, "std_msgs/msg/Strong", AttributeError),
        (utilities.get_interface, "no_such_msgs/msg/String", ModuleNotFoundError),
    ],
)
def test_an_unknown_name_is_an_error(get: Callable[[str], Any], name: str, error: type[Exception]) -> None:
    """Of the kind that ROS 2 raises."""
    with pytest.raises(error):
        get(name)


def test_fields_are_set_from_plain_values() -> None:
    """At any depth; `auto` and `now` are set by what is returned."""
    message = PoseStamped()
    assert set_message_fields(message, {"pose": {"position": {"x": 2}}}) == []
    assert message.pose.position.x == 2.0
    values = {"header": "auto", "poses": [{"position": {"y": 1.0}}]}
    poses = PoseArray()
    (set_time,) = set_message_fields(poses, values, expand_header_auto=True)
    set_time(Time(sec=5, nanosec=7))
    assert poses.header.stamp == Time(sec=5, nanosec=7)
    header = Header()
    (set_time,) = set_message_fields(header, {"stamp": "now", "frame_id": "map"}, expand_time_now=True)
    set_time(Time(sec=6))
    assert header == Header(stamp=Time(sec=6), frame_id="map")


def test_messages_are_rendered() -> None:
    """As YAML, CSV and dicts; the types of fields have their names."""
    message = String(data="x")
    assert rosidl_runtime_py.message_to_yaml(message) == "data: x\n"
    assert rosidl_runtime_py.message_to_csv(message) == "x"
    assert rosidl_runtime_py.message_to_ordereddict(message) == {"data": "x"}
    types = rosidl_runtime_py.get_message_slot_types(Header())
    assert types == {
        "stamp": NamespacedType(["builtin_interfaces", "msg"], "Time"),
        "frame_id": UnboundedString(),
    }
