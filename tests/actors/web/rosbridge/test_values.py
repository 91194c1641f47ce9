"""Messages from and to the values of rosbridge."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from msgspec import field

import actors
from actors.interfaces import types
from actors.interfaces.builtin_interfaces.msg import Duration
from actors.interfaces.codec import codec_for, decode_untyped
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.std_msgs.msg import Header, String
from actors.interfaces.unique_identifier_msgs.msg import UUID
from actors.web.calls import message_of
from actors.web.rosbridge.operations import OperationError
from actors.web.rosbridge.values import SMALL_BYTES, arguments_by_name, json_of, values_from_json
from proto.errors import CallboardError
from tests.actors.web.rosbridge.bridge import strict_json

LARGE = SMALL_BYTES + 1
"""A size from which on a message is encoded in pieces."""


class Inner(actors.Message, type_name="rosbridge_test/msg/Inner"):
    """A message in a message."""

    octets: types.ByteSequence = b""
    ratio: types.float32 = 0.0


class Mixed(actors.Message, type_name="rosbridge_test/msg/Mixed"):
    """Fields that JSON does not have."""

    octet: types.byte = b"\0"
    data: bytes = b""
    numbers: types.Int8Sequence = field(default_factory=types.Int8Array)
    values: types.Float64Sequence = field(default_factory=types.Float64Array)
    inner: Inner = field(default_factory=Inner)
    more: list[Inner] = field(default_factory=list[Inner])
    names: list[str] = field(default_factory=list[str])
    flags: list[bool] = field(default_factory=list[bool])
    large: int = 0


class Plain(actors.Message, type_name="rosbridge_test/msg/Plain"):
    """The same without `byte`."""

    data: bytes = b""
    numbers: types.Int8Sequence = field(default_factory=types.Int8Array)
    values: types.Float64Sequence = field(default_factory=types.Float64Array)
    large: int = 0


def _read(kind: type[Any], values: dict[str, Any]) -> Any:
    return message_of(kind, values_from_json(kind, values))


@pytest.mark.parametrize("size", [0, LARGE])
def test_values_of_all_kinds(size: int) -> None:
    """Bytes are base64, `byte` and int8 are numbers, what is not finite is null."""
    message = Mixed(
        octet=b"\xff", data=b"\0\xff", numbers=[-1, 2], values=[1.0, math.nan],
        inner=Inner(octets=b"\1", ratio=math.inf),
        more=[Inner(octets=b"\2")], names=["ä"], flags=[True], large=2**63 - 1,
    )  # fmt: skip
    assert strict_json(json_of(message, size).decode()) == {
        "octet": 255,
        "data": "AP8=",
        "numbers": [-1, 2],
        "values": [1.0, None],
        "inner": {"octets": [1], "ratio": None},
        "more": [{"octets": [2], "ratio": 0.0}],
        "names": ["ä"],
        "flags": [True],
        "large": 2**63 - 1,
    }


def test_the_sizes_of_messages_do_not_show() -> None:
    """Small ones are encoded another way."""
    message = Plain(data=b"\0\xff", numbers=[-1], values=[math.inf, 0.5], large=-(2**63))
    decoded = codec_for(Plain).decode(codec_for(Plain).encode(message))
    assert json_of(decoded, 0) == json_of(decoded, LARGE) == json_of(message, 0)


def test_a_message_of_unknown_type() -> None:
    """Is shown as it travels; what no message has is an error."""
    untyped = decode_untyped(codec_for(Plain).encode(Plain(data=b"\1", numbers=[1], values=[math.nan])))
    expected = {"data": "AQ==", "numbers": [1], "values": [None], "large": 0}
    assert strict_json(json_of(untyped, 0).decode()) == expected


def test_what_is_sent_is_read_back() -> None:
    """Every value of a message."""
    message = Mixed(
        octet=b"\x07", data=b"\0\xff", numbers=[-1, 2], values=[1.5],
        inner=Inner(octets=b"\1", ratio=0.5), more=[Inner()],
        names=["a"], flags=[True, False], large=-5,
    )  # fmt: skip
    assert _read(Mixed, json.loads(json_of(message, 0))) == message


def test_what_clients_send_is_read() -> None:
    """Lists for bytes, null for floats, integers for floats, other fields missing."""
    found = _read(Mixed, {"data": [1, 2], "values": [1, None], "inner": {"ratio": None, "octets": "AQ=="}})
    assert (found.data, found.values[0], found.inner.octets) == (b"\1\2", 1.0, b"\1")
    assert [math.isnan(each) for each in (found.values[1], found.inner.ratio)] == [True, True]


def test_times_have_the_names_of_both_versions_of_ros() -> None:
    """`secs` and `nsecs`, too."""
    assert _read(Duration, {"secs": 1, "nsecs": 2}) == Duration(sec=1, nanosec=2)


@pytest.mark.parametrize("values", [{}, {"header": {}}, {"header": {"frame_id": "map"}}, {"header": "auto"}])
def test_a_header_without_a_stamp_gets_the_time(values: dict[str, Any]) -> None:
    """Also without any header, as the protocol says."""
    found = _read(PoseStamped, values)
    assert found.header.stamp.sec > 0


def test_a_stamp_is_kept() -> None:
    """Also one of 0."""
    found = _read(PoseStamped, {"header": {"stamp": {"sec": 0, "nanosec": 0}}})
    assert found.header == Header()


@pytest.mark.parametrize(
    ("kind", "values", "text"),
    [
        (Mixed, {"color": 1}, "rosbridge_test/msg/Mixed has no field 'color'"),
        (Mixed, {"data": "?"}, "rosbridge_test/msg/Mixed.data: Expected base64, or a list of numbers"),
        (Mixed, {"data": "AQ"}, "Expected base64"),
        (Mixed, {"data": "ä"}, "Expected base64"),
        (Mixed, {"data": [256]}, "Expected an integer from 0 to 255"),
        (Mixed, {"data": [None]}, "Expected an integer from 0 to 255"),
        (Mixed, {"numbers": [200]}, "numbers"),
        (Mixed, {"numbers": {"0": 1}}, "numbers"),
        (Mixed, {"more": [{"data": 1}]}, r"more\[0\] has no field 'data'"),
        (Mixed, {"more": [3]}, r"more\[0\]: Expected a dict"),
        (Mixed, {"inner": 3}, "inner: Expected a dict"),
        (Mixed, {"large": None}, "large"),
        (String, {"data": {}}, "data"),
        (PoseStamped, {"header": {"stamp": 3}}, "stamp"),
    ],
)
def test_what_does_not_fit_is_an_error(kind: type[Any], values: dict[str, Any], text: str) -> None:
    """It names the field."""
    with pytest.raises(CallboardError, match=text):
        _read(kind, values)


def test_arguments_by_name_or_in_order() -> None:
    """Or none."""
    for args in ({"a": 1, "b": 2}, [1, 2]):
        assert arguments_by_name(AddTwoInts.Request, args) == {"a": 1, "b": 2}
    assert arguments_by_name(AddTwoInts.Request, None) == {}
    with pytest.raises(OperationError, match="has 2 fields, and there are 3 values"):
        arguments_by_name(AddTwoInts.Request, [1, 2, 3])


def test_a_fixed_array_of_bytes_has_its_length() -> None:
    """In base64, too."""
    assert _read(UUID, {"uuid": "AAECAwQFBgcICQoLDA0ODw=="}).uuid == bytes(range(16))
    with pytest.raises(CallboardError, match="uuid"):
        _read(UUID, {"uuid": "AAE="})
