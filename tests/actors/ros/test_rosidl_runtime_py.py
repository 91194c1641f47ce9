"""Messages from and to plain values, by the names of ROS 2's package."""

from __future__ import annotations

import sys
from pathlib import Path
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
    assert utilities.get_message("std_msgs/String") is String
    assert utilities.get_service("std_srvs/SetBool") is SetBool
    assert utilities.get_action("example_interfaces/Fibonacci") is Fibonacci
    assert rosidl_runtime_py.import_message_from_namespaced_type(Header.SLOT_TYPES[0]) is Time  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("get", "name", "error"),
    [
        (utilities.get_interface, "std_msgs/String", ValueError),
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


def test_interfaces_are_listed_by_kind() -> None:
    """Those of packages that have any, without parts of services and actions."""
    packages = ["std_srvs", "example_interfaces"]
    services = {"std_srvs": ["srv/Empty", "srv/SetBool", "srv/Trigger"]}
    assert services.items() <= rosidl_runtime_py.get_service_interfaces(packages).items()
    assert "std_srvs" not in rosidl_runtime_py.get_message_interfaces(packages)
    assert rosidl_runtime_py.get_action_interfaces() == {
        "action_tutorials_interfaces": ["action/Fibonacci"],
        "example_interfaces": ["action/Fibonacci"],
        "tf2_msgs": ["action/LookupTransform"],
    }
    assert rosidl_runtime_py.get_interfaces(["std_srvs"]) == services
    assert "std_srvs" in rosidl_runtime_py.get_interface_packages()
    with pytest.raises(LookupError, match="no_such_msgs"):
        rosidl_runtime_py.get_interfaces(["no_such_msgs"])


@pytest.mark.parametrize("name", ["std_srvs/srv/SetBool", "std_srvs/srv/SetBool.srv"])
def test_an_interface_has_a_file(name: str) -> None:
    """With or without its ending."""
    assert Path(rosidl_runtime_py.get_interface_path(name)).read_text().startswith("bool data\n---\n")


@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("String", ValueError),
        ("std_msgs//String", ValueError),
        ("std_msgs/../String", ValueError),
        ("no_such_msgs/msg/String", LookupError),
        ("std_msgs/msg/Strong", LookupError),
    ],
)
def test_no_interface_has_no_file(name: str, error: type[Exception]) -> None:
    """The error is that of ROS 2."""
    with pytest.raises(error):
        rosidl_runtime_py.get_interface_path(name)
