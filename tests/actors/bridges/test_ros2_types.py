"""Types on both sides: which cross, and why others do not; stand-ins are ROS 2's packages."""

from __future__ import annotations

import json
import sys
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from actors.bridges.ros2.errors import UnknownTypeError
from actors.bridges.ros2.types import MAX_TYPES, Types
from actors.interfaces import cdr
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.message import type_hash
from actors.interfaces.std_msgs.msg import Bool, String
from actors.interfaces.std_srvs.srv import SetBool

if TYPE_CHECKING:
    from pathlib import Path

SUPPORT = object()
"""What a class has whose C library is there."""


class Packages:
    """ROS 2's packages in a prefix."""

    def __init__(self, prefix: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self._share = prefix / "share"
        self._monkeypatch = monkeypatch
        monkeypatch.setenv("AMENT_PREFIX_PATH", str(prefix))

    def add(self, name: str, cls: Any, type_hash: str = "") -> None:
        """Install a class, with its hash."""
        package, folder, base = name.split("/")
        path = self._share / package / folder
        path.mkdir(parents=True, exist_ok=True)
        (self._share / package / "package.xml").touch()
        text = json.dumps({"type_hashes": [{"type_name": name, "hash_string": type_hash}]})
        (path / f"{base}.json").write_text(text if type_hash else "{}", encoding="utf-8")
        module = ModuleType(f"{package}.{folder}")
        setattr(module, base, cls)
        self._monkeypatch.setitem(sys.modules, package, ModuleType(package))
        self._monkeypatch.setitem(sys.modules, module.__name__, module)


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Packages:
    """An empty prefix, and the functions of rclpy that turn objects into CDR.

    The search for definitions in prefixes would outlive the test.
    """
    monkeypatch.setattr("actors.bridges.ros2.types.use_ros_interfaces", lambda: None)
    serialization: Any = ModuleType("rclpy.serialization")
    serialization.serialize_message = cdr.encode
    serialization.deserialize_message = lambda data, cls: cdr.decode(cls, data)
    monkeypatch.setitem(sys.modules, "rclpy.serialization", serialization)
    return Packages(tmp_path, monkeypatch)


def their_class(**attributes: Any) -> Any:
    """Return a class of rclpy."""
    return type("Their", (), {"_TYPE_SUPPORT": SUPPORT, **attributes})


def test_a_message_type(packages: Packages) -> None:
    """Both classes and both hashes are known; an endpoint of another hash is told with both."""
    theirs = their_class()
    packages.add("std_msgs/msg/String", theirs, type_hash(String))
    types = Types()
    known = types.known("std_msgs/msg/String")
    assert (known.kind, known.ours, known.theirs, known.reason) == ("msg", String, theirs, "")
    assert known.our_hash == known.their_hash == type_hash(String)
    assert types.known("std_msgs/msg/String") is known
    assert known.difference("") == known.difference(type_hash(String)) == ""
    assert "RIHS01_other in ROS 2" in known.difference("RIHS01_other")
    assert types.message("std_msgs/msg/String") is types.message("std_msgs/msg/String")
    with pytest.raises(UnknownTypeError, match="'std_msgs/msg/String' is no service type"):
        types.service("std_msgs/msg/String")


def test_a_service_and_an_action(packages: Packages) -> None:
    """Their parts are found below the classes, and have types of their own."""
    packages.add("std_srvs/srv/SetBool", their_class(Request=SetBool.Request, Response=SetBool.Response))
    sending = their_class(Request="request", Response="response")
    impl = SimpleNamespace(SendGoalService=sending, FeedbackMessage=their_class())
    packages.add("example_interfaces/action/Fibonacci", SimpleNamespace(Impl=impl))
    types = Types()
    service = types.service("std_srvs/srv/SetBool")
    assert service is types.service("std_srvs/srv/SetBool")
    data = service.request.from_object(SetBool.Request(data=True))
    assert service.request.to_object(data) == SetBool.Request(data=True)
    known = types.known("std_srvs/srv/SetBool")
    assert "the request of the service std_srvs/srv/SetBool" in known.difference("RIHS01_other")
    goal: Any = types.service("example_interfaces/action/Fibonacci_SendGoal")
    assert (goal.ours, goal.theirs) == (Fibonacci.Impl.SendGoalService, sending)
    assert goal.request.ours is goal.ours.Request
    feedback = types.known("example_interfaces/action/Fibonacci_FeedbackMessage")
    assert (feedback.kind, feedback.ours) == ("msg", Fibonacci.Impl.FeedbackMessage)


def test_types_that_do_not_cross(packages: Packages, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each reason names the type or package, and what to do."""
    packages.add("std_msgs/msg/Bool", their_class(), "RIHS01_other")
    packages.add("std_srvs/srv/Trigger", their_class(_TYPE_SUPPORT=None, __import_type_support__=None))
    packages.add("only_there/msg/Odd", their_class())
    types = Types()
    reasons = {name: types.known(name).reason for name in (
        "no type", "std_msgs/msg/String_Goal", "std_msgs/msg/Bool", "std_msgs/msg/Empty",
        "geometry_msgs/msg/Pose", "only_there/msg/Odd",
    )}  # fmt: skip
    assert reasons["no type"] == "'no type' is not the name of a type, such as std_msgs/msg/String"
    assert "is not the name of a type" in reasons["std_msgs/msg/String_Goal"]
    assert type_hash(Bool) in reasons["std_msgs/msg/Bool"]
    assert "RIHS01_other in ROS 2" in reasons["std_msgs/msg/Bool"]
    assert "has no msg/Empty: install another version" in reasons["std_msgs/msg/Empty"]
    assert "ROS 2 has no package geometry_msgs: install it (apt:" in reasons["geometry_msgs/msg/Pose"]
    assert reasons["only_there/msg/Odd"].startswith("callboard cannot use only_there/msg/Odd: ")
    with pytest.raises(UnknownTypeError, match="RIHS01_other"):
        types.message("std_msgs/msg/Bool")
    monkeypatch.setitem(sys.modules, "std_srvs.srv", None)
    assert "std_srvs of ROS 2 cannot be imported" in types.known("std_srvs/srv/Empty").reason


def test_a_package_without_its_library(packages: Packages) -> None:
    """The reason says to build it again."""

    class Meta(type):
        @classmethod
        def __import_type_support__(cls) -> None: ...

    packages.add("std_srvs/srv/Trigger", Meta("Their", (), {"_TYPE_SUPPORT": None}))
    assert "std_srvs/srv/Trigger has no type support" in Types().known("std_srvs/srv/Trigger").reason


@pytest.mark.usefixtures("packages")
def test_names_that_are_remembered() -> None:
    """Beyond their limit the oldest is looked up again."""
    types = Types()
    first = types.known("0")
    for number in range(1, MAX_TYPES):
        types.known(str(number))
    assert types.known("0") is first
    types.known("one more")
    assert types.known("0") is not first


def test_a_type_whose_support_cannot_be_loaded_does_not_cross(packages: Packages) -> None:
    """Whatever the package's code raises: rosidl's own error is no ImportError."""

    class Support(type):
        @classmethod
        def __import_type_support__(cls) -> None:
            raise RuntimeError("no open files are left")

    packages.add("std_msgs/msg/String", Support("Their", (), {"_TYPE_SUPPORT": None}))
    reason = Types().known("std_msgs/msg/String").reason
    assert reason.endswith("cannot be imported: no open files are left")
