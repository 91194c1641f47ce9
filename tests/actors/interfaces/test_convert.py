"""Messages from and to plain values."""

from __future__ import annotations

import json
import math
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest
import yaml

from actors.interfaces.codec import codec_for, decode_untyped
from actors.interfaces.convert import (
    message_from_fields,
    message_to_csv,
    message_to_ordereddict,
    message_to_yaml,
    set_message_fields,
)
from actors.interfaces.diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.geometry_msgs.msg import PoseStamped, PoseWithCovariance
from actors.interfaces.message import Message
from actors.interfaces.sensor_msgs.msg import Image, JointState
from actors.interfaces.std_msgs.msg import Bool, Byte, ByteMultiArray, Int32, String


def test_partial_fill_keeps_the_rest() -> None:
    """Only what is named changes, at any depth."""
    pose = PoseStamped()
    pose.pose.position.y = 2.0
    set_message_fields(pose, {"header": {"frame_id": "map"}, "pose": {"position": {"x": 1}}})
    assert (pose.header.frame_id, pose.pose.position.x, pose.pose.position.y) == ("map", 1.0, 2.0)
    assert pose.pose.orientation.w == 1.0


def test_lists_of_dicts_become_messages() -> None:
    """Also nested ones."""
    array = DiagnosticArray()
    set_message_fields(
        array, {"status": [{"name": "a", "values": [{"key": "k", "value": "v"}]}, DiagnosticStatus()]}
    )
    assert array.status[0].values == [KeyValue(key="k", value="v")]
    assert array.status[1] == DiagnosticStatus()


@pytest.mark.parametrize(
    ("values", "error", "text"),
    [
        ({"nope": 1}, AttributeError, "has no field 'nope'; it has header, pose"),
        ({"pose": {"position": {"w": 1}}}, AttributeError, r"PoseStamped\.pose\.position has no field 'w'"),
        (5, TypeError, "Expected a dict"),
        ({"header": 5}, TypeError, r"\.header: Expected a dict"),
        ({"pose": {"position": {"x": "a"}}}, ValueError, r"\.x: Expected a number, got 'a'"),
        ({"pose": {"position": {"x": None}}}, ValueError, r"\.x: Expected float, got None"),
        ({"header": {"stamp": {"sec": 2**40}}}, ValueError, r"\.sec: Expected int <= 2147483647"),
    ],
)
def test_errors_leave_the_message_alone(values: Any, error: type[Exception], text: str) -> None:
    """AttributeError for a key, TypeError for what is no dict, ValueError for a value."""
    pose = PoseStamped()
    with pytest.raises(error, match=text):
        set_message_fields(pose, values)
    assert pose == PoseStamped()


def test_scalars_are_taken_as_a_command_line_writes_them() -> None:
    """A number for a text, 1 for true, 3.0 for 3, an integer for a byte."""
    for message, value, expected in (
        (String(), 5, "5"),
        (Bool(), 1, True),
        (Int32(), 3.0, 3),
        (Byte(), 7, b"\x07"),
        (ByteMultiArray(), [1, 2], b"\1\2"),
    ):
        set_message_fields(message, {"data": value})
        assert message.data == expected
    image = Image()
    set_message_fields(image, {"data": [1, 2]})
    assert image.data == b"\1\2"
    for message, bad in (
        (Int32(), 3.5),
        (Byte(), 256),
        (ByteMultiArray(), "ab"),
        (ByteMultiArray(), 5),
        (Bool(), 2),
    ):
        with pytest.raises(ValueError, match="data"):
            set_message_fields(message, {"data": bad})
    covariance = PoseWithCovariance()
    set_message_fields(covariance, {"covariance": [1] * 36})
    with pytest.raises(ValueError, match=r"float64\[36\], got 35"):
        set_message_fields(covariance, {"covariance": [1] * 35})


def test_yaml_is_as_ros_prints_it() -> None:
    """Quotes only where needed, two spaces of indentation."""
    assert message_to_yaml(String(data="Hello World: 5")) == "data: 'Hello World: 5'\n"
    assert message_to_yaml(String(data="hello world"), truncate_length=5) == "data: hello...\n"
    assert message_to_yaml(String(data="é\x1b[31m")) == 'data: "é\\e[31m"\n'
    text = message_to_yaml(JointState(name=["a"], position=[1.0, 2.0]))
    assert text == (
        "header:\n  stamp:\n    sec: 0\n    nanosec: 0\n  frame_id: ''\nname:\n- a\nposition:\n- 1.0\n- 2.0\n"
        "velocity: []\neffort: []\n"
    )
    assert message_to_yaml(String(data="a"), flow_style=True) == "{data: a}\n"


def test_truncation() -> None:
    """Strings, sequences and strings in sequences; never keys."""
    state = JointState(name=["a long name", "b"], position=[1.0, 2.0, 3.0])
    plain = message_to_ordereddict(state, truncate_length=2)
    assert plain["name"] == ["a ...", "b"]
    assert plain["position"] == [1.0, 2.0, "..."]
    assert message_to_ordereddict(state, truncate_length=0)["position"] == ["..."]


def test_without_arrays_and_strings() -> None:
    """Descriptions with IDL names."""
    assert (
        message_to_ordereddict(PoseWithCovariance(), no_arr=True)["covariance"] == "<array type: double[36]>"
    )
    assert (
        message_to_ordereddict(ByteMultiArray(), no_arr=True)["data"] == "<sequence type: octet, length: 0>"
    )
    status = message_to_ordereddict(DiagnosticArray(status=[DiagnosticStatus()]), no_arr=True)["status"]
    assert status == "<sequence type: diagnostic_msgs/msg/DiagnosticStatus, length: 1>"
    assert message_to_ordereddict(String(data="x" * 15), no_str=True)["data"] == "<string length: <15>>"


@pytest.mark.parametrize(
    "message",
    [PoseStamped(), JointState(name=["a"], position=[1.0]), Image(data=b"abc"), PoseWithCovariance()],
)
def test_without_the_type_the_text_is_the_same(message: Any) -> None:
    """`topic echo` need not have the class."""
    raw = decode_untyped(codec_for(type(message)).encode(message))
    assert message_to_yaml(raw) == message_to_yaml(message)
    assert message_to_csv(raw) == message_to_csv(message)
    assert message_to_yaml(raw, truncate_length=1) == message_to_yaml(message, truncate_length=1)


def test_untyped_arrays_are_described_by_what_arrived() -> None:
    """The packed element type is known, a plain array's is not."""
    plain = message_to_ordereddict({"a": [1], "b": b"xx", **decode_untyped(b"\x80")}, no_arr=True)
    assert plain == {"a": "<sequence type: unknown, length: 1>", "b": "<sequence type: uint8, length: 2>"}


class Required(Message):
    must: int
    inner: KeyValue


def test_a_new_message_from_fields() -> None:
    """Also of a class whose fields have no defaults."""
    made = message_from_fields(Required, {"must": 1, "inner": {"key": "k"}})
    assert made == Required(must=1, inner=KeyValue(key="k"))
    with pytest.raises(ValueError, match="must"):
        message_from_fields(Required, {"inner": {}})


def test_hostile_untyped_messages_can_be_printed() -> None:
    """Deep nesting is refused; extensions, time stamps and odd keys are shown."""
    with pytest.raises(InvalidMessageError, match="nested"):
        message_to_yaml(decode_untyped(b"\x81\xa1a" + b"\x91" * 500 + b"\x01"))
    odd = decode_untyped(b"\x83\xa1a\xd4\x63\x00\xa1b\xd6\xff\x00\x00\x00\x00\xa1c\x81\x92\x01\x02\x03")
    text = message_to_yaml(odd)
    assert "a: '<extension 99, length: 1>'" in text
    assert "1970" in text


def test_numpy_values_can_be_printed() -> None:
    """A message that was built with NumPy and not sent yet."""
    state = JointState(position=np.array([1.0]))  # type: ignore[arg-type]
    state.header.stamp.sec = np.int32(3)  # type: ignore[assignment]
    assert "sec: 3" in message_to_yaml(state)
    assert "- 1.0" in message_to_yaml(state)


def test_csv() -> None:
    """All values in order."""
    assert message_to_csv(PoseStamped()) == "0,0,,0.0,0.0,0.0,0.0,0.0,0.0,1.0"


def test_what_types_do_not_know_becomes_plain() -> None:
    """A stranger's message may hold times, and keys that are no text: JSON takes them all the same."""
    strange = {"at": datetime(1970, 1, 1, 0, 0, 1, tzinfo=UTC), "map": {b"x": 1, (1,): 2, None: 3}}
    plain = message_to_ordereddict(strange)
    assert plain["at"] == "1970-01-01T00:00:01+00:00"
    assert json.loads(json.dumps(plain))["map"] == {"b'x'": 1, "(1,)": 2, "None": 3}


_ODD = [1.5e17, 1e17, 1e-7, -1e300, math.nan, math.inf, -math.inf, 0.0, -0.0, 1 / 3] * 10


@pytest.mark.parametrize("flow_style", [False, True])
@pytest.mark.parametrize(
    "values",
    [
        {"a": _ODD, "b": {"c": [[1] * 100, [2, 3], [True, False] * 50], "d": [{"x": [-5] * 70, "y": _ODD}]}},
        {
            "odd key: 'q' \xe9 #": [1] * 80,
            "d": [[[1.5] * 65]],
            "- x": list(range(64)),
        },
        {"text": "numbers_0", "numbers": [2**63] * 64, "mixed": [1, "a"] * 40},
    ],
)
def test_long_lists_of_numbers_are_written_as_by_pyyaml(values: dict[str, Any], flow_style: bool) -> None:
    """They are written without it, because it takes seconds for an image: nobody must see that."""
    expected = yaml.safe_dump(
        json.loads(json.dumps(values)),  # no list twice: PyYAML would refer to the first
        allow_unicode=True,
        default_flow_style=flow_style,
        sort_keys=False,
        width=2**31 - 1,
    )
    assert "&" not in expected
    assert message_to_yaml(values, flow_style=flow_style) == expected


def test_an_image_is_written_without_pyyaml(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its pixels do not get there; the text has them all."""
    seen: list[Any] = []
    dump = yaml.dump

    def noted(data: Any, **options: Any) -> Any:
        seen.append(data)
        return dump(data, **options)

    monkeypatch.setattr(yaml, "dump", noted)
    text = message_to_yaml(Image(height=480, width=640, data=bytes(640 * 480 * 3)))
    assert text.count("\n- 0") == 640 * 480 * 3
    assert len(seen[0]["data"]) == 1
