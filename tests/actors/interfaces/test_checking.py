"""Checks of fields where they are assigned."""

from __future__ import annotations

import copy
import math
import pickle
from collections import UserList
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
import numpy as np
import pytest

from actors.interfaces import types
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.checking import check_assignments
from actors.interfaces.codec import codec_for
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg import Header
from tests.interfaces.imported import Arrays, BasicTypes, BoundedSequences, UnboundedSequences

if TYPE_CHECKING:
    from collections.abc import Iterator


class Names(Message):
    name: Annotated[str, types.AtMost(3)] = ""
    names: Annotated[list[Annotated[str, types.AtMost(3)]], types.AtMost(2)] = msgspec.field(
        default_factory=list
    )


@pytest.fixture
def checked() -> Iterator[None]:
    """Check assignments during a test."""
    check_assignments()
    yield
    check_assignments(enabled=False)


WRONG = [
    (BasicTypes, "bool_value", 1, "of type 'bool'"),
    (BasicTypes, "byte_value", b"ab", "of type 'bytes' with length 1"),
    (BasicTypes, "int8_value", "1", "of type 'int'"),
    (BasicTypes, "int8_value", 128, "an integer in [-128, 127]"),
    (BasicTypes, "uint16_value", -1, "an unsigned integer in [0, 65535]"),
    (BasicTypes, "char_value", "a", "of type 'int'"),
    (BasicTypes, "float64_value", 1, "of type 'float'"),
    (BasicTypes, "float32_value", 3.5e38, "a float in [-3.402823466e+38, 3.402823466e+38]"),
    (Header, "frame_id", 5, "of type 'str'"),
    (Header, "stamp", 5, "a sub message of type 'Time'"),
    (Names, "name", "abcd", "string value not longer than 3"),
    (
        Names,
        "names",
        ["abcd"],
        "a set or sequence with length <= 2 and each string value not longer than 3",
    ),
    (
        UnboundedSequences,
        "int8_values",
        [200],
        "a set or sequence and each value of type 'int' and each integer in [-128, 127]",
    ),
    (UnboundedSequences, "string_values", "ab", "a set or sequence and each value of type 'str'"),
    (UnboundedSequences, "string_values", 5, "a set or sequence and each value of type 'str'"),
    (
        UnboundedSequences,
        "float64_values",
        np.zeros(2, "float32"),
        "a set or sequence and each value of type 'float'",
    ),
    (Arrays, "bool_values", [True], "a set or sequence with length 3 and each value of type 'bool'"),
    (
        BoundedSequences,
        "uint8_values",
        b"abcd",
        "a set or sequence with length <= 3 and each value of type 'int'",
    ),
]


@pytest.mark.usefixtures("checked")
@pytest.mark.parametrize(("cls", "name", "value", "expected"), WRONG)
def test_a_wrong_value_is_an_error_where_it_is_assigned(
    cls: type[Message], name: str, value: object, expected: str
) -> None:
    """Also where it is given to the class; the text says what the field takes, as ROS 2's."""
    message = cls()
    before = repr(message)
    with pytest.raises(AssertionError) as raised:
        setattr(message, name, value)
    assert str(raised.value).startswith(f"The '{name}' field must be {expected}")
    assert repr(message) == before
    with pytest.raises(AssertionError):
        cls(**{name: value})


@pytest.mark.usefixtures("checked")
@pytest.mark.parametrize(
    ("cls", "name", "value"),
    [
        (BasicTypes, "float32_value", math.inf),
        (BasicTypes, "float32_value", math.nan),
        (BasicTypes, "uint64_value", 2**64 - 1),
        (BasicTypes, "byte_value", b"a"),
        (Header, "stamp", Time(sec=1)),
        (Names, "names", ["a", "abc"]),
        (Arrays, "float64_values", np.zeros(3)),
        (Arrays, "byte_values", [b"a", b"b", b"c"]),
        (UnboundedSequences, "uint8_values", [0, 255]),
        (UnboundedSequences, "uint8_values", memoryview(b"a")),
        (UnboundedSequences, "int32_values", UserList([1])),
        (UnboundedSequences, "int32_values", types.Int32Array([1])),
        (UnboundedSequences, "basic_types_values", [BasicTypes()]),
    ],
)
def test_right_values_are_accepted(cls: type[Message], name: str, value: Any) -> None:
    """Whatever form they have."""
    message = cls(**{name: value})
    setattr(message, name, value)
    assert getattr(message, name) is value


@pytest.mark.usefixtures("checked")
def test_a_message_takes_its_own_fields_only() -> None:
    """Positional values are checked, too; ROS 2's own switch is accepted."""
    with pytest.raises(AssertionError, match="Invalid arguments passed to constructor: frame, id"):
        Header(frame="a", id=1)  # type: ignore[call-arg]
    with pytest.raises(AssertionError, match="'sec'"):
        Time("1")  # type: ignore[arg-type]
    with pytest.raises(AttributeError):
        Header().frame = "a"  # type: ignore[attr-defined]
    assert BasicTypes(check_fields=True) == BasicTypes()


@pytest.mark.usefixtures("checked")
def test_checked_messages_travel_and_are_copied() -> None:
    """As others."""
    message = Arrays(float64_values=[1.0, 2.0, 3.0])
    codec = codec_for(Arrays)
    assert codec.decode(codec.encode(message)) == message
    assert copy.deepcopy(message) == copy.copy(message) == pickle.loads(pickle.dumps(message)) == message


def test_checks_are_off_unless_switched_on() -> None:
    """Then a wrong value shows where the message is published; nothing of the checks remains."""
    header = Header(frame_id=5)  # type: ignore[arg-type]
    check_assignments()
    with pytest.raises(AssertionError):
        header.frame_id = 6  # type: ignore[assignment]
    for _ in range(2):
        check_assignments(enabled=False)
    header.frame_id = 6  # type: ignore[assignment]
    assert "__call__" not in type(Message).__dict__
