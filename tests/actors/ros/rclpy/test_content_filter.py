"""Content filters: what passes, and what is refused. tests/real_ros compares them with real ROS 2's."""

from __future__ import annotations

import pytest

from actors.interfaces.geometry_msgs.msg import Point, Point32, Polygon
from actors.interfaces.std_msgs.msg import Int32, String
from actors.ros.rclpy._rclpy_pybind11 import RCLError
from actors.ros.rclpy.content_filter import (
    MAX_DEPTH,
    MAX_LENGTH,
    MAX_PARAMETERS,
    compile_filter,
)


@pytest.mark.parametrize(
    ("expression", "numbers"),
    [
        ("", [1, 2, 3, 4, 5]),
        ("data > 1 AND NOT data = 3 OR data = 1", [2, 4, 5]),
        ("data = 1 OR data = 2 AND data = 3", []),
        ("data = 1 OR (data = 2 AND data = 3)", [1]),
        ("NOT NOT data = 1 OR data = 2", [1]),
        ("data NOT BETWEEN 2 AND 4", [1, 5]),
        ("2 <= data", [2, 3, 4, 5]),
        ("data >= -1 AND data < 0x3", [1, 2]),
        ("data = TRUE", [1]),
        ("data > 2.5", [3, 4, 5]),
    ],
)
def test_numbers(expression: str, numbers: list[int]) -> None:
    """AND and OR have one rank, and NOT is for one condition but groups the rest."""
    passes = compile_filter(expression, [], Int32)
    assert [number for number in range(1, 6) if passes(Int32(data=number))] == numbers


@pytest.mark.parametrize(
    ("pattern", "text", "matches"),
    [
        ("a%b%c", "a1b2c", True),
        ("a%b%c", "a1c2b", False),
        ("%ab%ab", "abab", True),
        ("%ab%ab", "ab", False),
        ("_b?", "abc", True),
        ("%", "a\nb", False),
        ("a", "ab", False),
        ("%a%a%a%a%a%a%a%a%a%a%a%a%b", "a" * 2000, False),
    ],
)
def test_patterns(pattern: str, text: str, matches: bool) -> None:
    """A pattern is for the whole string; the last one would take for ever if its parts tried again."""
    assert compile_filter("data LIKE %0", [f"'{pattern}'"], String)(String(data=text)) is matches


def test_elements_of_nested_messages() -> None:
    """A path may have indices; a message without the element does not pass, whatever is asked."""
    passes = compile_filter("NOT points[1].x > 1", [], Polygon)
    one, two = Point32(x=0.5), Point32(x=1.5)
    assert [passes(Polygon(points=each)) for each in ([one], [two, one], [one, two])] == [False, True, False]
    assert compile_filter("x > y", [], Point)(Point(x=1.0))


@pytest.mark.parametrize(
    ("expression", "parameters", "problem"),
    [
        ("data > %1", ["1"], "no parameter %1"),
        ("data > %0", ["one"], "no literal"),
        ("data > %0", ["'1'"], "cannot be compared"),
        ("nope = 1", [], "'nope' is not there"),
        ("data[0] = 1", [], "is no array"),
        ("1 = 1", [], "needs a field"),
        ("data MATCH 1", [], "has no MATCH"),
        ("data = 08", [], "octal"),
        ("data = 18446744073709551616", [], "64 bits"),
        ("data = 1 data = 2", [], "expected AND"),
        ("(data = 1", [], "closing bracket"),
        ("data = 1" + " " * MAX_LENGTH, [], "characters"),
        ("data = 1", ["1"] * (MAX_PARAMETERS + 1), "parameters"),
        ("(" * (MAX_DEPTH + 1), [], "in each other"),
        ("NOT " * (MAX_DEPTH + 1) + "data = 1", [], "in each other"),
    ],
)
def test_what_is_refused(expression: str, parameters: list[str], problem: str) -> None:
    """The error says what is wrong; length, nesting and parameters have limits."""
    with pytest.raises(RCLError, match=problem):
        compile_filter(expression, parameters, Int32)


def test_a_filter_at_its_limits_is_used() -> None:
    """As many conditions as fit take no frames of Python's stack each."""
    expression = "data=0 OR " * (MAX_LENGTH // 10 - 1) + "data=1"
    assert compile_filter(expression, [], Int32)(Int32(data=1))
