"""How a bridge finds ROS 2, and how it takes messages by its C library; a stand-in is what it finds."""

from __future__ import annotations

import ctypes
import sys
from functools import partial
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from actors.bridges.ros2.errors import RosError, RosNotFoundError
from actors.bridges.ros2.importing import (
    ARRIVAL_FUNCTIONS,
    OLD_PROFILE_VARIABLE,
    PROFILE_VARIABLE,
    import_ros,
)
from actors.bridges.ros2.message_taker import RosMessageInfo

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="needs glibc")

GID = bytes(range(16))


class Library:
    """librcl and librcutils; `messages` are handed over, numbers are codes of errors."""

    def __init__(self) -> None:
        self.messages: list[bytes | int] = []
        self.errors_reset = 0
        self.functions: dict[str, Callable[..., Any]] = {
            **{name: lambda *_: 0 for name in ARRIVAL_FUNCTIONS},
            "rcl_node_get_graph_guard_condition": lambda *_: 1,
            "rcl_wait_set_add_guard_condition": lambda *_: 0,
            "rcl_take_serialized_message": partial(self._take),  # a method has no attributes of its own
            "rcutils_get_default_allocator": partial(ctypes.c_void_p * 5),
            "rcutils_uint8_array_init": lambda *_: 0,
            "rcutils_reset_error": partial(self._reset_error),
        }

    def __getattr__(self, name: str) -> Callable[..., Any]:
        try:
            return self.functions[name]
        except KeyError:
            raise AttributeError(f"undefined symbol: {name}") from None

    def _reset_error(self) -> None:
        self.errors_reset += 1

    def _take(self, _: int, message: int, info: int, __: None) -> int:
        found = self.messages.pop(0) if self.messages else 401
        if isinstance(found, int):
            return found
        self._kept = ctypes.create_string_buffer(found, len(found))
        ctypes.memmove(message, (ctypes.c_size_t * 2)(ctypes.addressof(self._kept), len(found)), 16)
        numbers = (ctypes.c_int64 * 5)(10, 20, 3, 0, 0)
        ctypes.memmove(info, bytes(numbers) + GID, 56)
        return 0


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Library:
    """Put ROS 2 into this process; without variables or files of a user."""
    made, load = Library(), ctypes.CDLL
    monkeypatch.setattr(ctypes, "CDLL", lambda name, **_: load(name) if name is None else made)
    names = ("context", "node", "parameter", "qos", "signals", "event_handler", "callback_groups")
    for name in ("rclpy", "rclpy.impl", *(f"rclpy.{each}" for each in names)):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    sys.modules["rclpy"].__file__ = "/opt/ros/new/lib/rclpy/__init__.py"
    extension = SimpleNamespace(rclpy_get_rmw_implementation_identifier=lambda: "rmw_fastrtps_cpp")
    singleton: Any = ModuleType("rclpy.impl.implementation_singleton")
    singleton.rclpy_implementation = extension
    monkeypatch.setitem(sys.modules, singleton.__name__, singleton)
    for variable in (PROFILE_VARIABLE, OLD_PROFILE_VARIABLE, "AMENT_PREFIX_PATH"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setenv("RCUTILS_LOGGING_USE_STDOUT", "1")
    monkeypatch.chdir(tmp_path)
    return made


@pytest.mark.usefixtures("library")
def test_where_ros_comes_from(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """It is sourced if rclpy is below a prefix; a user's profile for Fast DDS is left alone."""
    ros = import_ros()
    assert (ros.distribution, ros.rmw, ros.has_own_profile) == ("wheels", "rmw_fastrtps_cpp", True)
    monkeypatch.setenv("AMENT_PREFIX_PATH", "/home/robot/install:/opt/ros/new")
    (tmp_path / "DEFAULT_FASTDDS_PROFILES.xml").touch()
    ros = import_ros()
    assert (ros.distribution, ros.has_own_profile) == ("sourced", False)
    with ros.profile(3):
        assert PROFILE_VARIABLE not in dict(sys.modules["os"].environ)


@pytest.mark.usefixtures("library")
def test_ros_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """One sentence says what to do: without ROS 2, and beside one for another Python."""
    monkeypatch.setitem(sys.modules, "rclpy", None)
    with pytest.raises(RosNotFoundError, match=r"^the bridge needs ROS 2's rclpy .*: pip install '"):
        import_ros()
    monkeypatch.setenv("AMENT_PREFIX_PATH", "/opt/ros/old")
    with pytest.raises(RosNotFoundError, match=r"^rclpy of the sourced ROS 2 \(/opt/ros/old\) does not work"):
        import_ros()


@pytest.mark.usefixtures("library")
def test_the_face_is_not_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    """callboard's own rclpy is refused, and so is an extension that does not load."""
    monkeypatch.delattr(sys.modules["rclpy.impl.implementation_singleton"], "rclpy_implementation")
    with pytest.raises(RosNotFoundError, match="the bridge needs ROS 2's rclpy"):
        import_ros()
    monkeypatch.setitem(sys.modules, "rclpy", ModuleType("actors.ros.rclpy"))
    with pytest.raises(RosNotFoundError, match=r"has imported callboard's \(actors.ros\)"):
        import_ros()


@pytest.mark.parametrize("name", [*ARRIVAL_FUNCTIONS, "rcl_take_serialized_message"])
def test_a_version_without_a_function(library: Library, name: str) -> None:
    """It is named, and the oldest version that has all."""
    del library.functions[name]
    with pytest.raises(
        RosNotFoundError, match=rf"needs ROS 2 Jazzy or later, on Linux: undefined symbol: {name}"
    ):
        import_ros()


def test_messages_are_taken(library: Library) -> None:
    """With what ROS 2 says about them; None if there is none, and an error with its code."""
    taker = import_ros().taker
    library.messages = [b"one\0two", 1]
    assert taker.take(1) == (b"one\0two", RosMessageInfo(GID, 3, 10, 20))
    with pytest.raises(RosError, match="does not hand over a message: code 1"):
        taker.take(1)
    assert library.errors_reset == 1
    assert taker.take(1) is None
