"""Parameter values: codes, type inference, text conversion, ranges."""

from __future__ import annotations

import array
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.interfaces.codec import codec_for
from actors.interfaces.rcl_interfaces import msg as rcl_interfaces
from actors.parameters.types import (
    FloatingPointRange,
    IntegerRange,
    Parameter,
    ParameterDescriptor,
    ParameterType,
    parameter_value_from_string,
)

VALUES: list[tuple[ParameterType, Any]] = [
    (ParameterType.NOT_SET, None),
    (ParameterType.BOOL, True),
    (ParameterType.INTEGER, 42),
    (ParameterType.DOUBLE, 3.5),
    (ParameterType.STRING, "foo"),
    (ParameterType.BYTE_ARRAY, [b"a", b"b"]),
    (ParameterType.BYTE_ARRAY, b"ab"),
    (ParameterType.BOOL_ARRAY, [True, False]),
    (ParameterType.INTEGER_ARRAY, [1, 2, 3]),
    (ParameterType.INTEGER_ARRAY, array.array("q", [1, 2])),
    (ParameterType.DOUBLE_ARRAY, (1.0, 2.0)),
    (ParameterType.STRING_ARRAY, ["a", "b"]),
]


def test_codes() -> None:
    """The codes are ROS 2's, and Parameter.Type is the same enum."""
    names = "NOT_SET BOOL INTEGER DOUBLE STRING BYTE_ARRAY BOOL_ARRAY INTEGER_ARRAY DOUBLE_ARRAY STRING_ARRAY"
    assert [kind.name for kind in ParameterType] == names.split()
    assert [int(kind) for kind in ParameterType] == list(range(10))
    assert Parameter.Type is ParameterType


@pytest.mark.parametrize(("kind", "value"), VALUES)
def test_type_of_a_value(kind: ParameterType, value: Any) -> None:
    """Each Python value has its type, and only that type takes it."""
    assert ParameterType.from_parameter_value(value) is kind
    assert [each for each in ParameterType if each.check(value)] == [kind]
    parameter = Parameter("p", value=value)
    assert (parameter.name, parameter.type_, parameter.value) == ("p", kind, value)
    assert parameter == Parameter("p", kind, value)


@pytest.mark.parametrize("value", [{}, object(), [1, "a"], [1, 2.0], [None], 1 << 63, [1 << 63], 1j, [[1]]])
def test_values_that_no_parameter_holds(value: Any) -> None:
    """Other types, mixed lists and ints over 64 bits are TypeErrors."""
    with pytest.raises(TypeError, match="not one of the allowed types"):
        Parameter("p", value=value)


def test_types_are_of_the_enumeration() -> None:
    """What is given as a type but is none is a TypeError that names the enumeration."""
    with pytest.raises(TypeError, match=r"'double' is not a type: use one of Parameter\.Type"):
        Parameter("p", "double", 1.0)  # type: ignore[arg-type]


def test_type_and_value_disagree() -> None:
    """A value that is not of the given type is a ValueError."""
    with pytest.raises(ValueError, match="do not agree"):
        Parameter("p", ParameterType.DOUBLE, 1)
    assert Parameter("p", ParameterType.INTEGER_ARRAY, []).type_ is ParameterType.INTEGER_ARRAY
    assert repr(Parameter("p", value=1)) == "Parameter('p', INTEGER, 1)"


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("True", True),
        ("42", 42),
        ("3.5", 3.5),
        ("[1, 2, 3]", [1, 2, 3]),
        ("[true, false]", [True, False]),
        ("[1.0, 2.5]", [1.0, 2.5]),
        ("[a, b]", ["a", "b"]),
        ("foo", "foo"),
        (" ", " "),
        ("", ""),
        ("[1, a]", "[1, a]"),
        ("[1, 2.5]", "[1, 2.5]"),
        ("{a: 1}", "{a: 1}"),
        ("2020-01-01", "2020-01-01"),
        ("null", "null"),
        ("[1,", "[1,"),
        ("a: b: c", "a: b: c"),
        ("!!python/name:os.system", "!!python/name:os.system"),
        ("99999999999999999999", "99999999999999999999"),
        ("[" * 1000, "[" * 1000),
        ("'42'", "42"),
    ],
)
def test_value_from_string(text: str, value: object) -> None:
    """YAML's scalars and plain lists are values; all other text is a string."""
    got = parameter_value_from_string(text)
    assert got == value
    assert type(got) is type(value)


@given(st.text())
def test_any_text_is_some_value(text: str) -> None:
    """No text raises, and what comes out is a value that a parameter holds."""
    ParameterType.from_parameter_value(parameter_value_from_string(text))


@pytest.mark.parametrize(
    ("value", "ok"),
    [(4.5, True), (0.0, True), (10.0, True), (12.0, False), (-0.5, False), (4.25, False), (0.1 + 0.4, True)],
)
def test_double_range(value: float, ok: bool) -> None:
    """A double has to be a whole number of steps between the bounds."""
    bounds = FloatingPointRange(from_value=0.0, to_value=10.0, step=0.5)
    assert (bounds.fault(value, "p") == "") is ok


@pytest.mark.parametrize(
    ("bounds", "value", "ok"),
    [
        (FloatingPointRange(from_value=0.0, to_value=10.0), math.inf, False),
        (FloatingPointRange(from_value=0.0, to_value=10.0, step=0.5), -math.inf, False),
        (FloatingPointRange(from_value=0.0, to_value=math.inf), -5.0, False),
        (FloatingPointRange(from_value=0.0, to_value=math.inf, step=0.5), 2.25, False),
        (FloatingPointRange(from_value=0.0, to_value=math.inf), math.inf, True),
        (FloatingPointRange(from_value=-math.inf, to_value=10.0, step=0.5), 2.25, True),
        (FloatingPointRange(from_value=0.0, to_value=1.0, step=1e-320), 0.5, True),
    ],
)
def test_infinity_in_a_double_range(bounds: FloatingPointRange, value: float, ok: bool) -> None:
    """Infinity is outside of finite bounds, and an infinite bound lets no other value pass the first."""
    assert (bounds.fault(value, "p") == "") is ok


def test_end_points_are_always_in_range() -> None:
    """The bounds themselves are allowed, also off the step."""
    assert not FloatingPointRange(from_value=0.0, to_value=1.2, step=0.5).fault(1.2, "p")
    assert not FloatingPointRange(from_value=0.0, to_value=1.2).fault(0.7, "p")
    assert FloatingPointRange(from_value=0.0, to_value=1.2).fault(float("nan"), "p")
    assert not IntegerRange(from_value=0, to_value=10, step=3).fault(10, "p")
    assert "valid step" in IntegerRange(from_value=0, to_value=10, step=3).fault(4, "p")
    assert "p out of range" in IntegerRange(from_value=0, to_value=10).fault(11, "p")
    assert not IntegerRange(from_value=0, to_value=10, step=0).fault(7, "p")


def test_ranges_apply_to_their_type_only() -> None:
    """Other types ignore a range."""
    descriptor = ParameterDescriptor(
        floating_point_range=[FloatingPointRange(from_value=0.0, to_value=1.0)],
        integer_range=[IntegerRange(from_value=0, to_value=1)],
    )
    for value in ("text", True, [5, 6], None):
        assert descriptor.fault(value) == ""
    assert descriptor.fault(5)
    assert descriptor.fault(5.0)


@pytest.mark.parametrize(("kind", "value"), VALUES)
def test_the_value_as_a_message(kind: ParameterType, value: Any) -> None:
    """rclpy's `get_parameter_value()`: the type and its field, in a message that can be sent."""
    message = Parameter("p", kind, value).get_parameter_value()
    codec = codec_for(rcl_interfaces.ParameterValue)
    received = codec.decode(codec.encode(message))
    assert received.type == kind
    if value is not None:
        found = getattr(received, f"{kind.name.lower()}_value")
        plain = bytes(found) if isinstance(found, memoryview) else found
        assert plain == value or [*plain] == [*value] or plain == b"".join(value)
