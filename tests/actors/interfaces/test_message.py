"""Message, Service and Action bases."""

from __future__ import annotations

import array
import copy
import importlib.machinery
import pickle
import sys
import types as python_types
from typing import Annotated, Any, ClassVar, cast

import msgspec
import numpy as np
import pytest

from actors.interfaces import types
from actors.interfaces.codec import codec_for
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.message import Action, Message, Service, definition, type_hash, type_name
from actors.interfaces.naming import package_of
from actors.interfaces.sensor_msgs.msg import Image, NavSatFix, NavSatStatus
from actors.interfaces.std_msgs.msg import Header, String


class Reading(Message):
    sensor: str
    value: float = 0.0


class Named(Message, type_name="lab_msgs/msg/Other"):
    LIMIT: ClassVar[types.int8] = 3
    data: int = 0


class Calibrate(Service):
    class Request(Message):
        sensor: str = ""

    class Response(Message):
        ok: bool = False


def test_type_names_are_ros_names() -> None:
    """Generated, derived and declared names."""
    assert type_name(String) == "std_msgs/msg/String"
    assert type_name(AddTwoInts) == "example_interfaces/srv/AddTwoInts"
    assert type_name(AddTwoInts.Request) == "example_interfaces/srv/AddTwoInts_Request"
    assert type_name(Fibonacci) == "example_interfaces/action/Fibonacci"
    assert type_name(Fibonacci.Goal) == "example_interfaces/action/Fibonacci_Goal"
    assert type_name(Named) == "lab_msgs/msg/Other"
    package = __name__.partition(".")[0]
    assert type_name(Reading) == f"{package}/msg/Reading"
    assert type_name(Calibrate.Response) == f"{package}/srv/Calibrate_Response"


def test_a_subclass_has_a_name_of_its_own() -> None:
    """A declared type name is not inherited: the subclass is another type."""

    class Sub(Named):
        more: int = 0

    assert type_name(Sub).endswith("/msg/Sub")


def test_a_scripts_classes_are_named_after_its_file(monkeypatch: pytest.MonkeyPatch) -> None:
    """A class of a script has the same name while the script runs and when it is imported."""
    main = python_types.ModuleType("__main__")
    monkeypatch.setitem(sys.modules, "__main__", main)
    assert package_of("__main__") == "main"
    main.__file__ = "/somewhere/weather_station.py"
    assert package_of("__main__") == package_of("weather_station") == "weather_station"
    main.__spec__ = importlib.machinery.ModuleSpec("robot.nodes.arm", None)
    assert package_of("__main__") == package_of("robot.nodes.arm") == "robot"


def test_reprs_are_ros_2s() -> None:
    """As `ros2 topic pub` and `ros2 service call` print them; binary fields as bytes."""
    assert repr(String(data="foo")) == "std_msgs.msg.String(data='foo')"
    assert repr(AddTwoInts.Request(a=5, b=3)) == "example_interfaces.srv.AddTwoInts_Request(a=5, b=3)"
    assert "data=b'abc'" in repr(Image(data=memoryview(b"abc")))
    assert "data=<1000 bytes>" in repr(Image(data=bytes(1000)))


def test_attributes_are_the_fields() -> None:
    """Assignment works, unknown attributes and keywords do not, constants cannot be assigned."""
    request = AddTwoInts.Request()
    request.a = 5
    assert (request.a, request.b) == (5, 0)
    with pytest.raises(AttributeError):
        request.c = 1  # type: ignore[attr-defined]
    with pytest.raises(TypeError):
        String(text="x")  # type: ignore[call-arg]
    status = NavSatStatus()
    assert NavSatStatus.STATUS_FIX == 0
    with pytest.raises(AttributeError):
        status.STATUS_FIX = 1  # type: ignore[misc]


def test_a_default_of_a_contained_message_is_kept() -> None:
    """A fix that nobody has filled in says that nothing is known, and not that there is a fix."""
    assert NavSatFix().status.status == NavSatStatus.STATUS_UNKNOWN == -2


def test_defaults_are_not_shared() -> None:
    """Two messages never share a nested message or a list."""
    one, other = PoseStamped(), PoseStamped()
    one.pose.position.x = 1.0
    assert other.pose.position.x == 0.0
    assert other.pose.orientation.w == 1.0


class Shared(Message):
    pose: PoseStamped = PoseStamped()
    path: types.Float64Sequence = types.Float64Array([1])
    grid: types.Float64Sequence = array.array("d", [1])
    weights: types.Float64Sequence = cast("Any", np.ones(1))


class Tagged(Message):
    tags: list[str] = msgspec.field(default_factory=list[str])
    extra: list[int] = msgspec.field(default_factory=lambda: [1])


def test_a_list_as_default_is_made_without_calling_its_alias() -> None:
    """To call `list[str]` for each message would take ten times as long; other factories stay."""
    assert [field.default_factory is list for field in msgspec.structs.fields(Tagged)] == [True, False]
    one, other = Tagged(), Tagged()
    one.tags.append("a")
    assert (other.tags, other.extra) == ([], [1])


def test_a_message_as_default_is_copied() -> None:
    """`pose: PoseStamped = PoseStamped()` gives each message a pose of its own; arrays are copied, too."""
    one, other = Shared(), Shared()
    one.pose.header.frame_id = "map"
    one.path.append(2)
    one.grid[0] = one.weights[0] = 2
    assert other.pose.header.frame_id == ""
    assert other.path == [1]
    assert (other.grid[0], other.weights[0]) == (1, 1)


def test_messages_copy_and_pickle() -> None:
    """Received messages hold views; copies of them hold bytes and are equal."""
    received = codec_for(Image).decode(
        codec_for(Image).encode(Image(data=b"abc", header=Header(frame_id="f")))
    )
    for other in (copy.deepcopy(received), pickle.loads(pickle.dumps(received))):
        assert other == received
        assert type(other.data) is bytes


@pytest.mark.parametrize("function", [type_name, type_hash, definition])
@pytest.mark.parametrize("wrong", [5, "std_msgs/msg/String", int, Message, Service, Action, None])
def test_wrong_arguments_are_reported(function: object, wrong: object) -> None:
    """What is no interface class raises a TypeError that says what to pass."""
    with pytest.raises(TypeError, match="Expected a message, service or action class"):
        function(wrong)  # type: ignore[operator]


def test_an_instance_is_told_apart() -> None:
    """Passing a message where its class belongs is the common slip."""
    with pytest.raises(TypeError, match="the class, not an instance"):
        type_name(String())


def test_a_service_needs_both_parts() -> None:
    """A service class without Response says so when it is written."""
    with pytest.raises(TypeError, match="class Response"):

        class Half(Service):
            class Request(Message):
                pass


def test_a_class_tells_its_fields() -> None:
    """With ROS 2's texts for their types; the dict is the caller's."""

    class Every(Message, type_name="lab/msg/Every"):
        name: Annotated[str, types.AtMost(10)] = ""
        names: Annotated[list[Annotated[str, types.AtMost(5)]], types.AtMost(3)] = msgspec.field(
            default_factory=list
        )
        flags: list[bool] = msgspec.field(default_factory=list)
        raw: types.ByteSequence = b""
        letters: types.CharSequence = b""
        ranges: types.Float32Sequence = msgspec.field(default_factory=types.Float32Array)
        rotation: Annotated[types.Float64Sequence, types.Length(9)] = types.Float64Array([0.0] * 9)
        header: Header = Header()

    assert list(Every.get_fields_and_field_types().items()) == [
        ("name", "string<10>"),
        ("names", "sequence<string<5>, 3>"),
        ("flags", "sequence<boolean>"),
        ("raw", "sequence<octet>"),
        ("letters", "sequence<uint8>"),
        ("ranges", "sequence<float>"),
        ("rotation", "double[9]"),
        ("header", "std_msgs/Header"),
    ]
    Every().get_fields_and_field_types().clear()
    assert len(Every.get_fields_and_field_types()) == 8
