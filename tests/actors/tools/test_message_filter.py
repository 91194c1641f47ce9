"""Expressions about a message."""

from __future__ import annotations

from typing import Any

import pytest

from actors.interfaces.geometry_msgs.msg import Twist, Vector3
from actors.interfaces.std_msgs.msg import Int32
from actors.tools.message_filter import InvalidFilterError, MessageFilter


@pytest.mark.parametrize(
    ("expression", "message", "passes"),
    [
        ("m.data > 3", Int32(data=4), True),
        ("m.data > 3", Int32(data=3), False),
        (" m.data % 2 == 0 ", Int32(data=2), True),
        ("m.linear.x", Twist(linear=Vector3(x=1.0)), True),
        ("m.linear.x", {"linear": {"x": 0.0}}, False),
        ("[p.x for p in m.points] == [1, 2]", {"points": [{"x": 1}, {"x": 2}]}, True),
        ("any(each in m.data for each in 'abc')", {"data": "xbx"}, True),
    ],
)
def test_an_expression_tells_messages_apart(expression: str, message: Any, passes: bool) -> None:
    """With a class and without; any value is taken for true or false."""
    assert MessageFilter(expression).passes(message) is passes


@pytest.mark.parametrize("expression", ["", "m.data >", "import os", "a\0b"])
def test_what_is_no_expression_is_refused_at_once(expression: str) -> None:
    """Before any message comes."""
    with pytest.raises(InvalidFilterError, match="is no Python expression"):
        MessageFilter(expression)


def test_an_expression_that_fails_says_why() -> None:
    """A mistyped field, say."""
    with pytest.raises(InvalidFilterError, match=r"filter 'm.dta > 3' failed: AttributeError: .*dta"):
        MessageFilter("m.dta > 3").passes(Int32())
