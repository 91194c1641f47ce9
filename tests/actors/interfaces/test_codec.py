"""Encoding, verification, decoding."""

# ruff: noqa: RUF012 - msgspec copies a default []

from __future__ import annotations

import array
import ctypes
import math
import struct
import tracemalloc
from collections import UserList
from typing import Annotated, Any, cast

import msgpack
import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.interfaces import types
from actors.interfaces.action_msgs.msg import GoalInfo, GoalStatus, GoalStatusArray
from actors.interfaces.codec import Codec, codec_for, decode_untyped
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Quaternion,
    Vector3,
)
from actors.interfaces.message import Message
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.sensor_msgs.msg import CameraInfo, Image, JointState, LaserScan, NavSatStatus
from actors.interfaces.std_msgs.msg import (
    ByteMultiArray,
    Empty,
    Header,
    Int32MultiArray,
    String,
    UInt8MultiArray,
)
from actors.interfaces.unique_identifier_msgs.msg import UUID
from proto.errors import CallboardError


class Part(Message, type_name="t_msgs/msg/Part"):
    name: Annotated[str, types.AtMost(5)] = ""
    small: types.int8 = 0


class Wider(Part):
    comment: str = ""


class Tree(Message, type_name="t_msgs/msg/Tree"):
    label: str = ""
    children: list[Tree] = []


class All(Message, type_name="t_msgs/msg/All"):
    yes: bool = False
    i: int = 0
    u: types.uint64 = 0
    f: float = 0.0
    g: types.float32 = 0.0
    s: str = ""
    w: types.wstring = ""
    one: types.byte = b"\x00"
    c: types.char = 0
    data: types.UInt8Sequence = b""
    plain: bytes = b""
    four: Annotated[types.ByteSequence, types.Length(4)] = bytes(4)
    doubles: types.Float64Sequence = types.Float64Array()
    singles: types.Float32Sequence = types.Float32Array()
    shorts: Annotated[types.Int16Sequence, types.AtMost(3)] = types.Int16Array()
    nine: Annotated[types.Float64Sequence, types.Length(9)] = types.Float64Array([0] * 9)
    numbers: list[float] = []
    integers: list[int] = []
    flags: list[bool] = []
    texts: Annotated[list[str], types.AtMost(2)] = []
    part: Part = Part()
    parts: list[Part] = []


def _view(data: bytes) -> memoryview:
    return memoryview(data)


INT8 = st.integers(-128, 127)
PARTS = st.builds(Part, name=st.text(max_size=5), small=INT8)
INT64 = st.integers(-(2**63), 2**63 - 1)
FLOATS = st.floats(allow_nan=False)
MESSAGES = st.builds(
    All,
    yes=st.booleans(),
    i=INT64,
    u=st.integers(0, 2**64 - 1),
    f=FLOATS,
    g=FLOATS,
    s=st.text(),
    w=st.text(),
    one=st.binary(min_size=1, max_size=1),
    c=st.integers(0, 255),
    data=st.binary() | st.binary().map(bytearray) | st.binary().map(_view),
    plain=st.binary(),
    four=st.binary(min_size=4, max_size=4),
    doubles=st.lists(FLOATS) | st.lists(FLOATS).map(types.Float64Array) | st.lists(FLOATS).map(np.array),
    singles=st.lists(st.floats(width=32, allow_nan=False)),
    shorts=st.lists(st.integers(-(2**15), 2**15 - 1), max_size=3),
    nine=st.lists(FLOATS, min_size=9, max_size=9),
    numbers=st.lists(FLOATS),
    integers=st.lists(INT64) | st.lists(INT64).map(types.Int64Array),
    flags=st.lists(st.booleans()),
    texts=st.lists(st.text(), max_size=2),
    part=PARTS,
    parts=st.lists(PARTS, max_size=3),
)
CODEC = codec_for(All)


@given(MESSAGES)
def test_any_valid_message_survives(message: All) -> None:
    """What is decoded equals what was encoded, in each way of encoding and decoding."""
    if isinstance(message.doubles, np.ndarray):
        message.doubles = types.Float64Array(message.doubles)
    data = CODEC.encode(message)
    assert CODEC.decode(data) == message
    assert CODEC.decode(memoryview(b"head" + data)[4:]) == message
    assert CODEC.decode_batch(b"\xdd" + struct.pack(">I", 2) + data * 2) == [message, message]
    assert list(decode_untyped(data)) == list(All.__struct_fields__)


@given(st.binary() | MESSAGES.map(lambda message: bytes(_damaged(CODEC.encode(message)))), st.integers())
def test_hostile_bytes_raise_one_error(data: bytes, seed: int) -> None:
    """Whatever arrives is a message or an InvalidMessageError."""
    for decode in (CODEC.decode, CODEC.decode_batch, decode_untyped):
        try:
            decode(data)
        except InvalidMessageError:
            continue


def _damaged(data: bytes) -> bytes:
    cut = len(data) // 2
    return data[:cut] + bytes([data[cut] ^ 0x55]) + data[cut + 1 :]


def _field(name: str, raw: bytes) -> bytes:
    return b"\x81" + msgpack.packb(name) + raw


@pytest.mark.parametrize(
    "raw",
    [
        b"",
        b"\xc1",
        b"\x80\x80",
        b"\x90",
        b"\xc0",
        b"\xdf\xff\xff\xff\xff",
        b"\xdd\xff\xff\xff\xff",
        _field("s", b"\xa2\xff\xfe"),
        _field("s", b"\xdb\xff\xff\xff\xff"),
        _field("data", b"\xc6\xff\xff\xff\xff"),
        _field("doubles", b"\xdd\xff\xff\xff\xff"),
        _field("doubles", b"\x91" * 100_000),
        _field("unknown", b"\x91" * 100_000),
        _field("doubles", b"\xc7\x03\x0aabc"),
        _field("doubles", b"\xd7\x09" + bytes(8)),
        _field("doubles", b"\xd7\x63" + bytes(8)),
        _field("doubles", b"\xd6\xff" + bytes(4)),
        _field("doubles", b"\x92\x01\xa1x"),
        _field("doubles", b"\x80"),
        _field("doubles", b"\x81\x80\x01"),
        _field("nine", b"\xd7\x0a" + bytes(8)),
        _field("integers", b"\x91\xca" + bytes(4)),
        _field("integers", b"\x91\xcf" + b"\xff" * 8),
        _field("i", b"\xcf" + b"\xff" * 8),
        _field("four", b"\xc4\x03abc"),
        _field("part", _field("small", b"\xcc\x80")),
        _field("parts", b"\x91\x01"),
        _field("yes", b"\x01"),
        msgpack.packb({b"\xff\xfe": 1}),
        b"\x81\x01\x01",
    ],
)
def test_broken_messages_are_refused_cheaply(raw: bytes) -> None:
    """Truncated, mistyped, out-of-range and oversized claims raise, without reserving what they claim."""
    tracemalloc.start()
    try:
        with pytest.raises(InvalidMessageError):
            CODEC.decode(raw)
        assert tracemalloc.get_traced_memory()[1] < 20_000_000
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"i": 2**63}, ".i: Expected int <= 9223372036854775807, got 9223372036854775808"),
        ({"i": 2**64}, ".i: Expected int <= 9223372036854775807, got 18446744073709551616"),
        ({"i": -(2**63) - 1}, ".i: Expected int >= -9223372036854775808, got -9223372036854775809"),
        ({"u": -1}, ".u: Expected int >= 0, got -1"),
        ({"u": 2**64}, ".u: Expected int <= 18446744073709551615, got 18446744073709551616"),
        ({"c": 256}, ".c: Expected int <= 255, got 256"),
        ({"i": True}, ".i: Expected int, got bool"),
        ({"i": "5"}, ".i: Expected int, got str"),
        ({"s": 5}, ".s: Expected str, got int"),
        ({"s": "\ud800"}, ".s: 'utf-8' codec can't encode"),
        ({"yes": 1}, ".yes: Expected bool, got int"),
        ({"one": b"ab"}, ".one: Expected bytes of length <= 1, got b'ab'"),
        ({"four": b"abc"}, ".four: Expected byte[4], got 3 elements"),
        ({"four": [1, 2, 3]}, ".four: Expected byte[4], got 3 elements"),
        ({"data": [1, 256]}, ".data: Expected uint8[]: bytes must be in range(0, 256), got [1, 256]"),
        ({"data": np.array([1, 2], ">u2")}, ".data: Expected uint8[], got uint16[]"),
        ({"data": "abc"}, ".data: Expected bytes, got str"),
        ({"flags": np.array([1, 0])}, ".flags: Expected bool[], got int64[]"),
        ({"flags": np.array([True])}, ".flags: Expected bool[], got ndarray of bool"),
        ({"doubles": np.array([1j])}, ".doubles: Expected float64[], got ndarray of complex128"),
        ({"doubles": {}}, ".doubles: Expected float64[], got dict"),
        ({"doubles": ["x"]}, ".doubles: Expected float64[]: must be real number, not str"),
        (
            {"doubles": np.array([1, 2])},
            ".doubles: Expected float64[], got int64[]; convert with Float64Array(value)",
        ),
        ({"doubles": np.zeros((2, 2))}, ".doubles: Expected a one-dimensional sequence, got 2 dimensions"),
        ({"doubles": 5}, ".doubles: Expected float64[], got int"),
        ({"nine": [1.0]}, ".nine: Expected float64[9], got 1 elements"),
        ({"nine": types.Float64Array([1])}, ".nine: Expected float64[9], got 1 elements"),
        ({"shorts": [1, 2, 3, 4]}, ".shorts: Expected int16[<=3], got 4 elements"),
        ({"shorts": [2**15]}, ".shorts: Expected int16[]"),
        (
            {"integers": [0, 2**64]},
            ".integers[1]: Expected int <= 9223372036854775807, got 18446744073709551616",
        ),
        ({"texts": ["a", "b", "c"]}, ".texts: Expected array of length <= 2"),
        ({"parts": [Part(), Part(small=128)]}, ".parts[1].small: Expected int <= 127, got 128"),
        (
            {"parts": [Part(), Part(small=2**70)]},
            ".parts[1].small: Expected int <= 127, got 1180591620717411303424",
        ),
        ({"part": Part(name="toolong")}, ".part.name: Expected str of length <= 5, got 'toolong'"),
        ({"part": None}, ".part: Expected t_msgs/msg/Part, got NoneType"),
        ({"part": {"name": "a"}}, ".part: Expected t_msgs/msg/Part, got dict"),
        ({"part": Part}, ".part: Expected t_msgs/Part, got MessageType"),
        ({"part": String(data="a")}, ".part: Expected t_msgs/msg/Part, got std_msgs/msg/String"),
        ({"parts": [Part(), Empty()]}, ".parts[1]: Expected t_msgs/msg/Part, got std_msgs/msg/Empty"),
        ({"parts": (Part(), String())}, ".parts[1]: Expected t_msgs/msg/Part, got std_msgs/msg/String"),
        ({"f": object()}, ".f: Expected float64, got object"),
        ({"f": 1j}, ".f: Expected float64, got complex"),
    ],
)
def test_wrong_values_raise_where_they_are_sent(changes: dict[str, Any], text: str) -> None:
    """The error names type, field path, expectation and value."""
    message = All()
    for name, value in changes.items():
        setattr(message, name, value)
    with pytest.raises(InvalidMessageError) as caught:
        CODEC.encode(message)
    expected = "t_msgs/msg/All" + text.replace(": Expected int16[]", ": Expected int16[<=3]")
    assert str(caught.value).startswith(expected)
    assert isinstance(caught.value, ValueError | CallboardError)


def test_a_nested_message_of_another_class_is_never_sent_as_a_new_one() -> None:
    """At any depth; what has the same fields is sent, as in ROS 2."""
    path = Path(poses=[PoseStamped(), PoseStamped(pose=cast("Any", Point(x=1.0)))])
    with pytest.raises(InvalidMessageError) as caught:
        codec_for(Path).encode(path)
    text = "nav_msgs/msg/Path.poses[1].pose: Expected geometry_msgs/msg/Pose, got geometry_msgs/msg/Point"
    assert str(caught.value) == text
    with pytest.raises(InvalidMessageError, match="got geometry_msgs/msg/Quaternion"):
        codec_for(Pose).encode(Pose(position=cast("Any", Quaternion(x=1.0))))
    path.poses[1].pose = Pose(position=cast("Any", Vector3(x=2.0)))
    assert codec_for(Path).decode(codec_for(Path).encode(path)).poses[1].pose.position == Point(x=2.0)
    tree = Tree(children=[Tree(label="a")])
    assert codec_for(Tree).decode(codec_for(Tree).encode(tree)) == tree
    tree.children[0].children = [cast("Any", String())]
    with pytest.raises(
        InvalidMessageError, match=r"children\[0\].children\[0\]: Expected t_msgs/msg/Tree, got"
    ):
        codec_for(Tree).encode(tree)


def test_nested_messages_of_a_subclass_are_sent_without_its_own_fields() -> None:
    """Alone and in lists; the outermost message may be of a subclass, too."""
    wider = Wider(name="a", small=3, comment="local")
    message = All(part=wider, parts=[wider, Part()])
    arrived = CODEC.decode(CODEC.encode(message))
    assert (arrived.part, arrived.parts) == (Part("a", 3), [Part("a", 3), Part()])
    assert type(arrived.parts[0]) is Part
    assert codec_for(Part).decode(codec_for(Part).encode(wider)) == Part("a", 3)


def test_a_sum_beyond_int64_is_an_error() -> None:
    """A service that adds two large numbers never sends a wrong one."""
    with pytest.raises(InvalidMessageError) as caught:
        codec_for(AddTwoInts.Response).encode(AddTwoInts.Response(sum=2**63 - 1 + 1))
    assert str(caught.value) == (
        "example_interfaces/srv/AddTwoInts_Response.sum: "
        "Expected int <= 9223372036854775807, got 9223372036854775808"
    )


def test_a_message_that_contains_itself_is_an_error() -> None:
    """No endless recursion."""
    message = All()
    message.part = message  # type: ignore[assignment]
    with pytest.raises(InvalidMessageError, match="contains itself"):
        CODEC.encode(message)


def test_a_deleted_field_is_an_error() -> None:
    """`del message.field` leaves nothing to send."""
    message = String()
    del message.data
    with pytest.raises(InvalidMessageError, match="data"):
        codec_for(String).encode(message)


@pytest.mark.parametrize(
    ("wrong", "got"),
    [("text", "str"), (Header(), "std_msgs/msg/Header"), (None, "NoneType"), (String, "MessageType")],
)
def test_another_class_is_a_type_error(wrong: Any, got: str) -> None:
    """Both types are named."""
    with pytest.raises(TypeError) as caught:
        codec_for(String).encode(wrong)
    assert str(caught.value) == f"Expected std_msgs/msg/String, got {got}"
    assert not isinstance(caught.value, CallboardError)


def test_another_class_of_the_same_type_is_told_apart() -> None:
    """The error names the classes, not one type twice."""

    class Mine(Message, type_name="std_msgs/msg/String"):
        data: str = ""

    with pytest.raises(TypeError, match=r"Expected <class '.*\.String'>, got <class '.*\.Mine'>"):
        codec_for(String).encode(cast("Any", Mine()))


@pytest.mark.parametrize("wrong", [int, "std_msgs/msg/String", String(), Message, AddTwoInts])
def test_only_message_classes_have_codecs(wrong: Any) -> None:
    """For anything else the error says what to pass."""
    with pytest.raises(TypeError, match="Expected a message"):
        Codec(wrong)


def test_codecs_are_made_once() -> None:
    """codec_for is cheap to call again."""
    assert codec_for(String) is codec_for(String)


def test_unknown_keys_are_ignored_and_missing_ones_default() -> None:
    """Types may grow; a field without default must come."""

    class Required(Message):
        must: int
        may: int = 7

    codec = codec_for(Required)
    assert codec.decode(msgpack.packb({"must": 1, "extra": [1]})) == Required(must=1, may=7)
    with pytest.raises(InvalidMessageError, match="must"):
        codec.decode(b"\x80")


def test_received_binary_is_a_view_that_keeps_its_bytes() -> None:
    """uint8[] is not copied, also in a run; the view outlives the call."""
    codec = codec_for(Image)
    data = codec.encode(Image(data=bytes(100_000)))
    image = codec.decode(data)
    assert isinstance(image.data, memoryview)
    assert image.data.obj is data
    assert image == Image(data=bytes(100_000))


def test_arrays_come_back_as_arrays_and_lists_as_lists() -> None:
    """The annotation decides, not what was sent."""
    message = CODEC.decode(CODEC.encode(All(doubles=[1, 2], numbers=types.Float64Array([1]), integers=[1])))  # type: ignore[arg-type]
    assert type(message.doubles) is types.Float64Array
    assert message.numbers == [1.0]
    assert type(message.numbers) is list
    assert type(message.integers) is list


def test_numpy_values_are_taken() -> None:
    """NumPy scalars, strided arrays and integer arrays of the field's type."""
    scan = LaserScan(
        angle_min=np.float32(0.5),  # type: ignore[arg-type]
        ranges=np.arange(6, dtype=np.float32)[::2],  # type: ignore[arg-type]
    )
    status = NavSatStatus(service=np.uint16(3))  # type: ignore[arg-type]
    assert codec_for(LaserScan).decode(codec_for(LaserScan).encode(scan)).ranges == [0.0, 2.0, 4.0]
    assert codec_for(NavSatStatus).decode(codec_for(NavSatStatus).encode(status)).service == 3
    image = Image(data=np.arange(3, dtype=np.uint8))  # type: ignore[arg-type]
    assert bytes(codec_for(Image).decode(codec_for(Image).encode(image)).data) == b"\0\1\2"


def test_not_a_number_and_infinity_travel() -> None:
    """Floats are IEEE's."""
    state = JointState(position=[math.nan, math.inf, -math.inf])
    received = codec_for(JointState).decode(codec_for(JointState).encode(state)).position
    assert math.isnan(received[0])
    assert received[1:].tolist() == [math.inf, -math.inf]  # type: ignore[attr-defined]


def test_stock_msgpack_reads_a_message() -> None:
    """Another language needs nothing but msgpack and the extension codes."""
    data = codec_for(CameraInfo).encode(CameraInfo(d=[1.5], height=2))
    plain = msgpack.unpackb(data)
    assert plain["height"] == 2
    assert plain["d"] == [1.5]
    assert plain["k"] == msgpack.ExtType(10, bytes(72))


def test_untyped_decoding_gives_plain_values() -> None:
    """Without the type a message is a dict, with arrays where the sender packed them."""
    plain = decode_untyped(codec_for(CameraInfo).encode(CameraInfo(header=Header(frame_id="f"))))
    assert plain["header"]["frame_id"] == "f"
    assert plain["k"] == types.Float64Array([0] * 9)
    for wrong in (b"\x93\x01\x02\x03", b"\x81\x01\x01", b"\xc1"):
        with pytest.raises(InvalidMessageError):
            decode_untyped(wrong)


def test_the_wires_float_may_be_an_integer() -> None:
    """A writer in a language without the difference may send 1 for 1.0."""
    assert CODEC.decode(msgspec.msgpack.encode({"f": 1})).f == 1.0


@pytest.mark.parametrize(
    ("msg_type", "values", "expected"),
    [
        (UInt8MultiArray, [1, 255], b"\x01\xff"),
        (UInt8MultiArray, (1, 2), b"\x01\x02"),
        (UInt8MultiArray, array.array("B", [1, 2]), b"\x01\x02"),
        (UInt8MultiArray, np.array([1, 2], dtype="u1"), b"\x01\x02"),
        (ByteMultiArray, [b"a", b"b"], b"ab"),
        (Int32MultiArray, [1, 2], [1, 2]),
        (Int32MultiArray, (1, 2), [1, 2]),
        (Int32MultiArray, array.array("i", [1, 2]), [1, 2]),
        (Int32MultiArray, np.array([1, 2], dtype="i4"), [1, 2]),
        (Int32MultiArray, np.array([1, 2], dtype=">i4"), [1, 2]),
        (Int32MultiArray, np.array([2, 9, 1], dtype=">i4")[::-2], [1, 2]),
        (Int32MultiArray, (ctypes.c_int * 2)(1, 2), [1, 2]),
        (Int32MultiArray, range(1, 3), [1, 2]),
        (Int32MultiArray, UserList([1, 2]), [1, 2]),
        (Int32MultiArray, [np.int32(1), np.int64(2)], [1, 2]),
        (Int32MultiArray, np.array([], dtype="i4"), []),
    ],
)
def test_numeric_sequences_take_what_rosidl_takes(msg_type: Any, values: Any, expected: Any) -> None:
    """Lists, tuples, arrays and NumPy arrays, also of `uint8` and `byte`, of any size."""
    codec = codec_for(msg_type)
    data = codec.encode(msg_type(data=values))
    assert codec.decode(data).data == expected
    assert codec.encode_behind(msg_type(data=values), 4) == bytes(4) + data


def test_fixed_arrays_take_what_rosidl_takes() -> None:
    """The same for `uint8[16]` and `float64[36]`, in nested messages and sequences of messages, too."""
    covariance = [float(number) for number in range(36)]
    for values in (covariance, tuple(covariance), array.array("d", covariance), np.array(covariance)):
        pose = PoseWithCovariance(covariance=cast("Any", values))
        assert codec_for(PoseWithCovariance).decode(codec_for(PoseWithCovariance).encode(pose)) == (
            PoseWithCovariance(covariance=cast("Any", covariance))
        )
    uuid = UUID(uuid=cast("Any", list(range(16))))
    goals = GoalStatusArray(status_list=[GoalStatus(goal_info=GoalInfo(goal_id=uuid))])
    decoded = codec_for(GoalStatusArray).decode(codec_for(GoalStatusArray).encode(goals))
    assert bytes(decoded.status_list[0].goal_info.goal_id.uuid) == bytes(range(16))
    assert cast("Any", uuid).uuid == list(range(16))


@pytest.mark.parametrize("values", [[256], [-1], [1.5], [b"ab"], ["a"], [None]])
def test_lists_that_are_no_bytes_are_refused(values: Any) -> None:
    """An element out of range or of another type."""
    with pytest.raises(InvalidMessageError, match=r"UInt8MultiArray\.data: Expected uint8\[\]"):
        codec_for(UInt8MultiArray).encode(UInt8MultiArray(data=values))


@given(st.lists(st.floats(allow_nan=False)), st.text())
def test_decoded_messages_are_encoded_without_verifying_them(values: list[float], name: str) -> None:
    """The bytes are the same."""
    codec = codec_for(JointState)
    message = codec.decode(codec.encode(JointState(name=[name], position=values)))
    assert codec.encode_decoded(message) == codec.encode(message)
