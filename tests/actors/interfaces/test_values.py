"""What sequence fields hold: how messages compare and print."""

from __future__ import annotations

import array
import math
import sys
from typing import Annotated, Any, cast

import msgspec
import numpy as np
import pytest
import yaml

from actors.interfaces import types
from actors.interfaces.codec import codec_for
from actors.interfaces.convert import message_from_fields, message_to_yaml
from actors.interfaces.geometry_msgs.msg import Pose, PoseWithCovariance, PoseWithCovarianceStamped
from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg import CameraInfo, Image, JointState
from actors.interfaces.std_msgs.msg import ByteMultiArray, Float32MultiArray, String, UInt8MultiArray
from actors.interfaces.unique_identifier_msgs.msg import UUID
from tests.interfaces.imported import Arrays, BoundedSequences, UnboundedSequences


class Lists(Message):
    fixed: Annotated[list[types.int64], types.Length(2)] = msgspec.field(default_factory=lambda: [0, 0])
    flags: list[bool] = msgspec.field(default_factory=list[bool])
    texts: list[str] = msgspec.field(default_factory=list[str])


class Loose(Message, eq=False):
    data: types.Float64Sequence = types.Float64Array([1])


class NoRosType(Message):
    data: Later = msgspec.field(default_factory=dict[str, int])


Later = dict[str, int]
"""No type of a field; the class is made before that can be known."""


def _given(values: list[float], element: str = "f8") -> list[Any]:
    """Return the ways to give numbers to a field."""
    typecode = {"f8": "d", "f4": "f", "u1": "B"}[element]
    return [
        values,
        tuple(values),
        array.array(typecode, cast("Any", values)),
        np.array(values, element),
        np.array(values, ">" + element),
    ]


COVARIANCE = [float(number) for number in range(36)]


def _pose(covariance: Any) -> PoseWithCovarianceStamped:
    return PoseWithCovarianceStamped(pose=PoseWithCovariance(covariance=covariance))


@pytest.mark.parametrize("left", _given(COVARIANCE), ids=lambda given: type(given).__name__)
@pytest.mark.parametrize("right", _given(COVARIANCE), ids=lambda given: type(given).__name__)
def test_messages_are_equal_however_their_arrays_were_given(left: Any, right: Any) -> None:
    """Lists, tuples, arrays and NumPy arrays of equal numbers are equal, also when received."""
    codec = codec_for(PoseWithCovarianceStamped)
    assert _pose(left) == _pose(right)
    assert codec.decode(codec.encode(_pose(left))) == _pose(right)
    changed = list(right)
    changed[-1] += 1
    for other in _given(changed):
        assert _pose(left) != _pose(other)
    assert _pose(left) != _pose(left[:1])
    assert _pose(left) != _pose(np.array(COVARIANCE).reshape(6, 6))


@pytest.mark.parametrize("msg_type", [Arrays, UnboundedSequences, BoundedSequences])
@pytest.mark.parametrize(
    "element", ["float32", "float64", *(f"{u}int{8 << n}" for n in range(4) for u in ("", "u"))]
)
def test_every_numeric_sequence_takes_every_form(msg_type: Any, element: str) -> None:
    """Fixed, bounded and unbounded ones are sent, received, printed as YAML and read from YAML alike."""
    codec, name, numbers = codec_for(msg_type), f"{element}_values", np.array([1, 0, 2], element)
    plain = numbers.tolist()
    expected = msg_type(**{name: plain})
    text = message_to_yaml(expected)
    for given in (
        plain,
        tuple(plain),
        array.array(numbers.dtype.char, plain),
        numbers,
        numbers.astype(numbers.dtype.newbyteorder()),
        np.repeat(numbers, 2)[::2],
    ):
        message = msg_type(**{name: given})
        received = codec.decode(codec.encode(message))
        assert received == message == expected == message_from_fields(msg_type, {name: given})
        assert list(getattr(received, name)) == plain
        assert repr(received) == repr(message)
        assert message_to_yaml(message) == message_to_yaml(received) == text
    assert message_from_fields(msg_type, {name: yaml.safe_load(text)[name]}) == expected


def test_elements_compare_as_their_fields_type() -> None:
    """float32 rounds, and bytes are numbers, as in a message that was received."""
    for data in _given([0.1], "f4"):
        assert Float32MultiArray(data=data) == Float32MultiArray(data=[0.1])
    for data in (*_given([1, 2], "u1"), b"\x01\x02", bytearray(b"\x01\x02"), memoryview(b"\x01\x02")):
        assert UInt8MultiArray(data=data) == UInt8MultiArray(data=b"\x01\x02")
    assert ByteMultiArray(data=cast("Any", [b"a", b"b"])) == ByteMultiArray(data=b"ab")
    assert Lists(texts=cast("Any", ("a",)), flags=cast("Any", np.array([True]))) == Lists(
        texts=["a"], flags=[True]
    )


def test_sequences_with_nan_are_never_equal() -> None:
    """Not even one and the same, as in ROS 2; messages without NaN are equal to themselves."""
    for data in _given([math.nan, 1.0], "f4"):
        message = Float32MultiArray(data=data)
        assert message != Float32MultiArray(data=data)
        assert message != message
    one = Float32MultiArray(data=[1.0])
    assert one == one


def test_other_values_and_types_are_not_equal() -> None:
    """A value that does not fit compares, too; types and `eq=False` count as before."""
    assert _pose("abc") != _pose(COVARIANCE)
    assert _pose("abc") == _pose("abc")
    assert _pose(None) == _pose(None)
    assert String(data="a") != "a"
    assert Pose() != PoseWithCovariance()
    assert Loose() != Loose()
    assert NoRosType(data={"a": 1}) == NoRosType(data={"a": 1})
    with pytest.raises(TypeError, match="unhashable"):
        hash(JointState())


def test_fixed_arrays_of_numbers_print_as_ros_2s() -> None:
    """As NumPy arrays with their element type; an array that does not fit prints as it is."""
    uuid = "array([1, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], dtype=uint8)"
    assert repr(UUID(uuid=bytes([1, 2] + [0] * 14))) == f"unique_identifier_msgs.msg.UUID(uuid={uuid})"
    assert "k=array([0., 0., 0., 0., 0., 0., 0., 0., 0.])" in repr(CameraInfo())
    assert "k=array([0. , 0.5])" in repr(CameraInfo(k=[0, 0.5]))
    assert "k='abc'" in repr(CameraInfo(k=cast("Any", "abc")))
    assert "fixed=array([1, 2])" in repr(Lists(fixed=[1, 2]))
    printed = repr(Arrays())
    assert "float32_values=array([0., 0., 0.], dtype=float32)" in printed
    assert "int8_values_default=array([   0,  127, -128], dtype=int8)" in printed
    assert "char_values=array([0, 0, 0], dtype=uint8)" in printed
    assert "bool_values=[False, False, False]" in printed
    assert "byte_values=b'" in printed


def test_fixed_arrays_print_without_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    """NumPy is an extra: without it the elements print as Python's numbers."""
    monkeypatch.setitem(sys.modules, "numpy", None)
    assert "k=array([0.0, 0.5])" in repr(CameraInfo(k=[0, 0.5]))
    assert "float32_values=array([0.0, 0.0, 0.0], dtype=float32)" in repr(Arrays())
    assert CameraInfo(k=[0.0] * 9) == CameraInfo()


def test_sequences_print_as_ros_2s() -> None:
    """As lists, however they were given; `uint8[]` as bytes."""
    for values in _given([1.0, 2.5]):
        assert "position=[1.0, 2.5], velocity=[]" in repr(JointState(position=values))
    assert "data=b'abc'" in repr(Image(data=memoryview(b"abc")))
    assert "texts=['a']" in repr(Lists(texts=["a"]))
