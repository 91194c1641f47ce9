"""The values of messages that programs for ROS 2 receive."""

from __future__ import annotations

import builtins
from array import array
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
import numpy as np
import pytest

from actors.interfaces import types
from actors.interfaces.codec import codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.geometry_msgs.msg import PoseWithCovarianceStamped
from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg import Image, LaserScan
from actors.interfaces.std_msgs.msg import String
from actors.ros.rclpy.executors import SingleThreadedExecutor
from actors.ros.rclpy.node import Node
from actors.ros.rclpy.task import Future
from actors.ros.values import convert_assignments, rosidl_values
from tests.interfaces.imported import Arrays, UnboundedSequences
from tests.seams.ros import forget_numpy

if TYPE_CHECKING:
    from actors.ros.rclpy.context import Context


class Pair(Message):
    images: list[Image] = msgspec.field(default_factory=list)


class Telemetry(Message):
    name: str = ""
    counts: types.Int32Sequence = msgspec.field(default_factory=types.Int32Array)
    raw: types.UInt8Sequence = b""
    matrix: Annotated[types.Float64Sequence, types.Length(9)] = msgspec.field(
        default_factory=lambda: types.Float64Array([0.0] * 9)
    )


class Measurement(Message):
    values: types.Float64Sequence = msgspec.field(default_factory=types.Float64Array)
    count: int = 0


class Measurements(Message):
    last: Measurement = msgspec.field(default_factory=Measurement)


class Telemetries(Message):
    last: Telemetry = msgspec.field(default_factory=Telemetry)


def received(message: Message) -> Any:
    """Return a message as callboard decodes it."""
    codec = codec_for(type(message))
    return codec.decode(codec.encode(message))


def test_sequences_are_rosidls() -> None:
    """Arrays of uint8 that can be changed, lists of bytes; other sequences are arrays already."""
    sent = UnboundedSequences(uint8_values=b"\1\2", byte_values=b"ab", char_values=b"c", float32_values=[0.5])
    message = rosidl_values(received(sent))
    assert message.uint8_values == array("B", [1, 2])
    message.uint8_values.append(3)
    assert message.byte_values == [b"a", b"b"]
    assert message.char_values == array("B", b"c")
    assert isinstance(message.float32_values, array)
    assert "byte_values=[b'a', b'b']," in repr(message)


def test_fixed_arrays_are_numpys() -> None:
    """At any depth, of the element's type, and to be changed."""
    message = rosidl_values(received(PoseWithCovarianceStamped()))
    covariance = message.pose.covariance
    assert covariance.reshape(6, 6).dtype == np.float64
    covariance[0] = 1.0
    assert received(message).pose.covariance[0] == 1.0
    arrays = rosidl_values(received(Arrays()))
    assert arrays.uint8_values.dtype == np.uint8
    arrays.uint8_values[2] = 9
    assert arrays.int16_values.dtype == np.int16
    assert [type(each) for each in arrays.bool_values] == [bool] * 3


def test_converted_messages_travel() -> None:
    """They equal what they were made of, and a second conversion changes nothing."""
    sent = Arrays(uint8_values=b"\1\2\3", byte_values=b"abc")
    message = rosidl_values(rosidl_values(received(sent)))
    assert message == sent
    assert received(message) == sent


def test_messages_in_sequences_are_converted() -> None:
    """Each of them."""
    message = rosidl_values(received(Pair(images=[Image(data=b"\1"), Image(data=b"\2")])))
    assert [image.data for image in message.images] == [array("B", [1]), array("B", [2])]


def test_other_values_are_left_alone() -> None:
    """Bytes of a raw subscription, and messages that have nothing to convert."""
    for each in (b"raw", String(data="x"), LaserScan(ranges=[1.0])):
        assert rosidl_values(each) is each


def test_numpy_is_not_required(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without it fixed arrays of numbers stay what they were."""
    importing = builtins.__import__

    def without_numpy(name: str, *args: Any, **kwargs: Any) -> Any:
        if name == "numpy":
            raise ImportError(name)
        return importing(name, *args, **kwargs)

    forget_numpy()
    monkeypatch.setattr(builtins, "__import__", without_numpy)
    message = rosidl_values(received(Arrays(uint8_values=b"\1\2\3")))
    monkeypatch.undo()
    forget_numpy()
    assert type(message.float64_values) is type(received(message).float64_values)
    assert message.uint8_values == array("B", [1, 2, 3])


def test_a_subscription_gets_them(context: Context) -> None:
    """Whichever node published the message."""
    with Node("camera", context=context) as node, SingleThreadedExecutor(context=context) as executor:
        executor.add_node(node)
        future = Future[Any]()
        node.create_subscription(Image, "image", future.set_result, 1)
        publisher = node.create_publisher(Image, "image", 1)
        node.create_timer(0.01, lambda: publisher.publish(Image(data=b"\1\2")))
        executor.spin_until_future_complete(future, 20)
    image: Any = future.result()
    assert image.data == array("B", [1, 2])


def test_assigned_lists_become_arrays() -> None:
    """As ROS 2's setters make them, also in nested messages; what does not fit is left."""
    convert_assignments(Telemetry)
    message: Any = Telemetry()
    message.counts, message.raw, message.matrix = [1, 2], (3, 4), [0.5] * 9
    assert repr(message.counts) == "array('i', [1, 2])"
    assert message.raw == array("B", [3, 4])
    matrix: Any = message.matrix
    assert matrix.dtype == np.float64
    message.name = "x"
    message.counts = ["x"]
    assert message.counts == ["x"]
    outer: Any = Telemetries(last=Telemetry())
    convert_assignments(Telemetries)
    outer.last.counts = [3]
    assert type(outer.last.counts) is type(Telemetry().counts)


@pytest.mark.parametrize("given", [np.array([1, 2]), np.array([1.0, 2.0], np.float32), array("B", [1, 2])])
def test_arrays_of_other_types_are_sent_as_the_fields(given: Any) -> None:
    """Also those given to a constructor, at any depth; core programs go on hearing of the mistake."""
    convert_assignments(Measurements)
    sent = Measurements(last=Measurement(values=given, count=True))
    assert received(sent) == Measurements(last=Measurement(values=[1.0, 2.0], count=1))
    with pytest.raises(InvalidMessageError, match="values"):
        received(Measurement(values=given))


def test_numbers_that_would_change_are_refused() -> None:
    """Fractions, numbers out of range, and what is no sequence of numbers."""
    convert_assignments(Telemetry)
    odd: Any = (np.array([1.5]), np.array([2**40]), np.array([[1]]), np.array(["x"]), {"x": 1}, 1)
    for wrong in odd:
        with pytest.raises(InvalidMessageError, match="counts"):
            received(Telemetry(counts=wrong))


def test_only_sequences_of_numbers_are_converted() -> None:
    """Other classes keep the fast assignment of the core."""
    convert_assignments(String)
    assert "__setattr__" not in String.__dict__
