"""CDR: bytes written by hand, random messages next to a plain encoder, and whatever else arrives."""

from __future__ import annotations

import math
import struct
from array import array
from random import Random
from typing import Annotated, Any, cast

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.interfaces import cdr, types
from actors.interfaces.builtin_interfaces.msg import Time  # noqa: TC001 - its annotation is read
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.fields import fields_of
from actors.interfaces.geometry_msgs.msg import Point, Polygon, Pose, PoseWithCovariance, Quaternion
from actors.interfaces.message import Message, definition, message_class
from actors.interfaces.registry import find_interface
from actors.interfaces.runtime_types import runtime_message
from actors.interfaces.sensor_msgs.msg import CameraInfo, Image, JointState
from actors.interfaces.std_msgs.msg import (
    Bool,
    ByteMultiArray,
    Float32,
    Float64MultiArray,
    Header,
    Int8,
    String,
    UInt8,
    UInt64,
)
from actors.interfaces.visualization_msgs.msg import MarkerArray
from tests.interfaces.cdr_vectors import MISREAD, READ, REFUSED, WRITTEN, Vector, class_of
from tests.interfaces.imported import TYPES
from tests.interfaces.random_messages import message_classes, random_message, values_of


class Part(Message, type_name="t_msgs/msg/Part"):
    name: Annotated[str, types.AtMost(5)] = ""
    small: types.int8 = 0


class Tree(Message, type_name="t_msgs/msg/Tree"):
    label: str = ""
    children: list[Tree] = []  # noqa: RUF012 - msgspec copies a default []
    last: types.uint16 = 0


class Mixed(Message, type_name="t_msgs/msg/Mixed", kw_only=True):
    """Fields of which a small one is followed by a large one, and classes that are written by hand."""

    yes: bool = False
    part: Part = Part()
    wide: types.wstring = ""
    plain: bytes = b""
    changing: bytearray = bytearray()
    numbers: list[float] = []  # noqa: RUF012
    integers: list[types.int8] = []  # noqa: RUF012
    flags: Annotated[list[bool], types.AtMost(3)] = []  # noqa: RUF012
    flag: types.boolean = False
    texts: list[str] = []  # noqa: RUF012
    short: types.int16 = 0
    wides: list[types.wstring] = []  # noqa: RUF012
    three: Annotated[types.Float64Sequence, types.Length(3)] = types.Float64Array([0] * 3)
    two: Annotated[list[str], types.Length(2)] = msgspec.field(default_factory=lambda: ["", ""])
    char: types.char = 0
    trees: Annotated[list[Tree], types.AtMost(2)] = []  # noqa: RUF012
    points: list[Point] = []  # noqa: RUF012
    one: types.byte = b"\0"
    times: list[Time] = []  # noqa: RUF012


CLASSES = [
    Mixed,
    Tree,
    *(cls for names in TYPES.values() for name in names for cls in message_classes(find_interface(name))),
]
SAMPLE = (Mixed, Tree, MarkerArray, CameraInfo, find_interface("test_msgs/msg/MultiNested"))


class _Plain:
    """Encodes as the rules say, one value after the other."""

    def __init__(self, order: str) -> None:
        self._order = order
        self._body = bytearray()

    def whole(self, message: Message) -> bytes:
        self._message(message)
        return (b"\0\1\0\0" if self._order == "<" else b"\0\0\0\0") + self._body

    def _pack(self, code: str, value: object) -> None:
        self._body += bytes(-len(self._body) % struct.calcsize(f"={code}"))
        self._body += struct.pack(self._order + code, value)

    def _message(self, message: Message) -> None:
        fields = fields_of(cast("Any", type(message)))
        if not fields:
            self._pack("B", 0)
        for field in fields:
            value = getattr(message, field.name)
            if not field.type.is_array:
                self._value(field.type.base, value)
                continue
            if not field.type.is_fixed:
                self._pack("I", len(value))
            for each in value:
                self._value(field.type.base, each)

    def _value(self, base: str, value: Any) -> None:
        if isinstance(value, Message):
            self._message(value)
        elif base == "wstring":
            units = value.encode("utf-16-le")
            self._pack("I", len(units) // 2)
            for (unit,) in struct.iter_unpack("<H", units):
                self._pack("I", unit)
        elif base == "string":
            data = value.encode() + b"\0"
            self._pack("I", len(data))
            self._body += data
        elif base in {"byte", "char", "uint8"}:
            self._body.append(value[0] if isinstance(value, bytes) else value)
        else:
            codes = {"bool": "?", "float32": "f", "float64": "d", "int8": "b", "int16": "h", "uint16": "H"}
            codes |= {"int32": "i", "uint32": "I", "int64": "q", "uint64": "Q"}
            self._pack(codes[base], value)


@pytest.mark.parametrize("vector", WRITTEN, ids=str)
def test_bytes_are_those_of_the_rules(vector: Vector) -> None:
    """A message is written as the rules of CDR say, and read again."""
    cls, data = class_of(vector.type_name), bytes.fromhex(vector.data)
    message = cdr.decode(cls, data)
    assert values_of(message) == vector.values
    assert cdr.encode(message) == data


@pytest.mark.parametrize("vector", READ, ids=str)
def test_what_other_programs_write_is_read_as_in_ros(vector: Vector) -> None:
    """Another byte order, surplus bytes, and strings that rclpy would not write."""
    message = cdr.decode(class_of(vector.type_name), bytes.fromhex(vector.data))
    assert values_of(message) == vector.values


@pytest.mark.parametrize(("name", "data"), [*REFUSED, *MISREAD])
def test_what_ros_refuses_is_refused(name: str, data: str) -> None:
    """Short messages, and other representations."""
    with pytest.raises(InvalidMessageError):
        cdr.decode(class_of(name), bytes.fromhex(data))


def test_another_representation_is_named() -> None:
    """It is not called a short message, and rclpy's accidents are not repeated: it takes 00 07 for plain."""
    for data in ("00070000 02000000 6100", "00070000"):
        with pytest.raises(
            InvalidMessageError, match=r"String: Expected plain CDR.*00 01 or 00 00, got 00 07"
        ):
            cdr.decode(String, bytes.fromhex(data))


@pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: cls.__qualname__)
def test_messages_of_all_types_are_those_of_a_plain_encoder(cls: type[Message]) -> None:
    """In both byte orders; what is cut anywhere is refused, and surplus bytes are ignored."""
    random = Random(cls.__qualname__)
    data = b""
    for message in (random_message(cls, random) for _ in range(3)):
        data = cdr.encode(message)
        assert data == _Plain("<").whole(message)
        for each in (data, memoryview(b"head" + data)[4:], data + b"surplus", _Plain(">").whole(message)):
            assert cdr.decode(cls, each) == message
    ends = range(len(data)) if len(data) < 600 else random.sample(range(len(data)), 300)
    for end in ends:
        with pytest.raises(InvalidMessageError):
            cdr.decode(cls, data[:end])


@given(st.sampled_from(SAMPLE), st.randoms(use_true_random=False))
def test_any_message_survives(cls: type[Message], random: Random) -> None:
    """What is decoded equals what was encoded, in values and in their classes."""
    message = random_message(cls, random)
    data = cdr.encode(message)
    found = cdr.decode(cls, data)
    assert found == message
    assert cdr.encode(found) == data
    assert data == _Plain("<").whole(message)


@given(
    st.sampled_from(SAMPLE),
    st.randoms(use_true_random=False),
    st.lists(st.tuples(st.integers(0, 400), st.sampled_from([0, 1, 0x7F, 0x80, 0xFF])), max_size=8),
    st.binary(max_size=64),
)
def test_hostile_bytes_raise_one_error(
    cls: type[Message], random: Random, changes: list[tuple[int, int]], data: bytes
) -> None:
    """Whatever arrives is a message, which can be written again, or an InvalidMessageError."""
    damaged = bytearray(cdr.encode(random_message(cls, random)))
    for place, value in changes:
        damaged[place % len(damaged)] = value
    for each in (damaged, b"\0\1\0\0" + data, b"\0\0\0\0" + data, data):
        try:
            found = cdr.decode(cls, each)
        except InvalidMessageError:
            continue
        assert cdr.decode(cls, cdr.encode(found)) is not None


@pytest.mark.parametrize("name", TYPES["test_msgs"])
def test_types_that_are_made_at_run_time_have_the_same_bytes(name: str) -> None:
    """A class made of a definition encodes what the class of the package does."""
    for cls in message_classes(find_interface(name)):
        made = runtime_message(definition(cls))
        data = cdr.encode(random_message(cls, Random(name)))
        assert cdr.encode(cdr.decode(made, data)) == data


def test_classes_of_values_are_those_of_msgpack() -> None:
    """Numbers are arrays or the lists that the class has declared, and bytes what it has declared."""
    mixed = Mixed(plain=b"a", changing=bytearray(b"b"), numbers=[1.5], integers=[-1])
    found = cdr.decode(Mixed, cdr.encode(mixed))
    kinds: list[Any] = [
        type(getattr(found, name)) for name in ("plain", "changing", "numbers", "integers", "three")
    ]
    assert kinds == [bytes, bytearray, list, list, types.Float64Array]
    image = cdr.decode(Image, cdr.encode(Image(data=b"abc")))
    assert isinstance(image.data, memoryview)
    assert image.data.readonly


@pytest.mark.parametrize(
    ("message", "expected"),
    [
        (Float64MultiArray(data=cast("Any", [1, 2.5])), [1.0, 2.5]),
        (Float64MultiArray(data=cast("Any", np.array([1.0, 2.5]))), [1.0, 2.5]),
        (Float64MultiArray(data=cast("Any", np.array([1.0, 9.0, 2.5])[::2])), [1.0, 2.5]),
        (Float64MultiArray(data=cast("Any", np.array([1.0, 2.5], ">f8"))), [1.0, 2.5]),
        (Float64MultiArray(data=cast("Any", array("d", [1.0]))), [1.0]),
        (Float64MultiArray(data=cast("Any", np.array([]))), []),
        (Float64MultiArray(data=types.Float64Array()), []),
        (Float64MultiArray(data=types.Float64Array([0.5] * 1000)), [0.5] * 1000),
        (ByteMultiArray(data=cast("Any", [b"\1", b"\xff"])), [1, 255]),
        (ByteMultiArray(data=memoryview(b"abcd")[::2]), [97, 99]),
        (ByteMultiArray(data=cast("Any", np.array([1, 2], "uint8"))), [1, 2]),
        (Float32(data=math.inf), math.inf),
        (Float32(data=cast("Any", np.float32(1.5))), 1.5),
        (UInt64(data=cast("Any", np.uint64(5))), 5),
        (Bool(data=cast("Any", np.bool_(True))), True),
    ],
    ids=repr,
)
def test_values_that_fields_take_are_converted(message: Message, expected: object) -> None:
    """As by the msgpack codec."""
    found: Any = cdr.decode(type(message), cdr.encode(message))
    assert values_of(found)["data"] == expected


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (String(data="a\0b"), r"std_msgs/msg/String\.data: Expected a string without NUL, got 'a\\x00b'"),
        (String(data=cast("Any", 1)), r"String\.data: Expected str, got int"),
        (String(data="\ud800"), "String"),
        (Int8(data=128), r"Int8\.data: Expected int <= 127, got 128"),
        (UInt8(data=-1), r"UInt8\.data: Expected int >= 0, got -1"),
        (UInt64(data=2**64), "UInt64"),
        (Float32(data=1e39), r"Float32\.data: Expected float32, got 1e\+39"),
        (Bool(data=cast("Any", 1)), r"Bool\.data: Expected bool, got int"),
        (Bool(data=cast("Any", "False")), r"Bool\.data: Expected bool, got str"),
        (Mixed(texts=["", "a\0"]), r"Mixed\.texts: Expected a string without NUL"),
        (Mixed(trees=[Tree(), Tree(label="\0")]), r"Mixed\.trees\[1\]\.label: Expected a string without NUL"),
        (Mixed(two=["a"]), r"Mixed\.two: .*length"),
        (Mixed(part=Part(name="longer")), r"Mixed\.part\.name: .*length <= 5"),
        (Mixed(flags=[False] * 4), r"Mixed\.flags: .*length <= 3"),
        (Mixed(three=types.Float64Array([1])), r"Mixed\.three: .*got 1 elements"),
        (Mixed(three=cast("Any", types.Float32Array([1] * 3))), r"Mixed\.three: .*float32"),
        (Mixed(one=b"ab"), r"Mixed\.one: "),
        (PoseWithCovariance(covariance=types.Float64Array([1])), r"\.covariance: .*got 1 elements"),
        (Mixed(flags=cast("Any", [1])), r"Mixed\.flags\[0\]: Expected bool, got int"),
        (ByteMultiArray(data=cast("Any", {1: 2})), r"ByteMultiArray\.data: "),
        (Pose(position=cast("Any", Quaternion())), r"Pose\.position: "),
        (Polygon(points=cast("Any", [Quaternion()])), r"Polygon\.points\[0\]: "),
        (Polygon(points=cast("Any", [1])), r"Polygon\.points\[0\]: "),
        (JointState(name=cast("Any", "abc")), r"JointState\.name: "),
        (Header(stamp=cast("Any", "now")), r"Header\.stamp: "),
    ],
    ids=repr,
)
def test_values_that_do_not_fit_are_refused(message: Message, text: str) -> None:
    """Nothing is written, and the error says which field has which value."""
    with pytest.raises(InvalidMessageError, match=text):
        cdr.encode(message)


@pytest.mark.parametrize(
    ("cls", "data", "text"),
    [
        (Mixed, cdr.encode(Mixed())[:30], r"Mixed: 30 bytes are too few"),
        # Cut within an element, whose array says something else.
        (Float64MultiArray, cdr.encode(Float64MultiArray(data=cast("Any", [1.0, 2.0])))[:-3], "are too few"),
        (find_interface("test_msgs/msg/WStrings"), b"\0\1\0\0\1\0\0\0\0\0", "WStrings: 10 bytes are too few"),
        (Part, b"\0\1\0\0\7\0\0\0longer\0\0", r"Part\.name: Expected string<=5, got 6 characters"),
        (
            find_interface("test_msgs/msg/WStrings"),
            b"\0\1\0\0\1\0\0\0\0\xd8\0\0" + bytes(60),
            "WStrings: a wstring is not UTF-16",
        ),
        (
            find_interface("test_msgs/msg/WStrings"),
            b"\0\1\0\0\1\0\0\0\0\0\1\0" + bytes(60),
            "WStrings: a wstring is not UTF-16",
        ),
        (
            find_interface("test_msgs/msg/BoundedSequences"),
            b"\0\1\0\0\4\0\0\0" + bytes(200),
            r"BoundedSequences\.bool_values: Expected bool\[<=3\], got 4 elements",
        ),
    ],
)
def test_errors_of_received_messages_say_what_is_wrong(cls: type[Message], data: bytes, text: str) -> None:
    """The type, the field if it is known, and the reason."""
    with pytest.raises(InvalidMessageError, match=text):
        cdr.decode(cls, data)


def test_a_message_that_contains_itself_is_an_error() -> None:
    """It would have no end; received ones may be nested as deeply as their bytes say."""
    tree = Tree()
    tree.children = [tree]
    with pytest.raises(InvalidMessageError, match="contains itself"):
        cdr.encode(tree)
    level = struct.pack("<II", 0, 1)
    with pytest.raises(InvalidMessageError, match="nested too deeply"):
        cdr.decode(Tree, b"\0\1\0\0" + level * 20_000)


def test_another_class_is_a_type_error() -> None:
    """Both are named."""
    with pytest.raises(TypeError, match="Expected std_msgs/msg/String, got std_msgs/msg/Int8"):
        cdr.codec_for(String).encode(cast("Any", Int8()))
    with pytest.raises(TypeError, match="Expected a message class"):
        cdr.codec_for(cast("Any", find_interface("std_srvs/srv/SetBool")))


@pytest.mark.parametrize("data", [5, [0, 1, 0, 0, 1], "text", None], ids=repr)
def test_what_is_no_bytes_is_a_type_error(data: Any) -> None:
    """Nor is a number so many zeros."""
    with pytest.raises(TypeError):
        cdr.decode(Bool, data)


def test_codecs_are_made_once() -> None:
    """A codec is expensive to make."""
    assert cdr.codec_for(String) is cdr.codec_for(String)


def test_large_types_and_deep_ones_are_functions_of_their_own() -> None:
    """The code of a type is not longer than its definition, however often its parts are in it."""
    inner: Any = Part
    for level in range(20):
        fields: dict[str, Any] = {f"field_{index}": (inner, inner) for index in range(2)}
        fields["flag"] = (bool, True)
        fields["items"] = (list[inner], [])
        made = message_class(
            Message, f"t_msgs/msg/Level{level}", fields if level < 4 else {"inner": (inner, inner)}
        )
        inner = made
    wide = message_class(
        Message, "t_msgs/msg/Wide", {f"field_{index}": (CameraInfo, CameraInfo) for index in range(60)}
    )
    many = message_class(Message, "t_msgs/msg/Many", {f"field_{index}": (str, "") for index in range(1000)})
    for cls in (inner, wide, many):
        message = random_message(cls, Random(1))
        data = cdr.encode(message)
        assert data == _Plain("<").whole(message)
        assert cdr.decode(cls, data) == message
        assert cdr.decode(cls, _Plain(">").whole(message)) == message


def test_a_field_whose_name_is_a_keyword_is_refused() -> None:
    """Names of fields become part of a program. (Python itself refuses all but identifiers.)"""
    cls = message_class(Message, "t_msgs/msg/Odd", {"class": (int, 0)})
    with pytest.raises(TypeError, match="Field 'class' of message class Odd is a Python keyword"):
        cdr.codec_for(cls)
