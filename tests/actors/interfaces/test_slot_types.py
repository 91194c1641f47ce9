"""The types of fields as objects."""

from __future__ import annotations

from typing import Annotated

import msgspec
import pytest

from actors.interfaces import slot_types as of
from actors.interfaces import types
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg import Header
from tests.interfaces.imported import Arrays, BasicTypes, Empty, UnboundedSequences


class Names(Message):
    plain: types.wstring = ""
    short: Annotated[types.wstring, types.AtMost(4)] = ""
    some: Annotated[list[Annotated[str, types.AtMost(5)]], types.AtMost(10)] = msgspec.field(
        default_factory=list
    )


class Odd(Message):
    value: Later = msgspec.field(default_factory=dict)


Later = dict[str, int]
"""No type of a field; the class is made before that can be known."""


def test_each_field_has_a_type() -> None:
    """Of the class that ROS 2's parser has for it, in order."""
    assert of.slot_types(Header) == (
        of.NamespacedType(["builtin_interfaces", "msg"], "Time"),
        of.UnboundedString(),
    )
    assert BasicTypes.SLOT_TYPES[:4] == tuple(map(of.BasicType, ("boolean", "octet", "uint8", "float")))
    assert Arrays.SLOT_TYPES[4] == of.Array(of.BasicType("double"), 3)
    assert UnboundedSequences.SLOT_TYPES[4] == of.UnboundedSequence(of.BasicType("double"))
    assert (
        of.UnboundedWString(),
        of.BoundedWString(4),
        of.BoundedSequence(of.BoundedString(5), 10),
    ) == Names.SLOT_TYPES
    assert Empty().SLOT_TYPES == ()


def test_types_say_what_they_are() -> None:
    """Programs distinguish them by their bases and by whether they have a limit."""
    _, short, some = Names.SLOT_TYPES
    assert isinstance(short, of.AbstractWString)
    assert short.has_maximum_size()
    assert not of.UnboundedString().has_maximum_size()
    assert isinstance(some, of.AbstractSequence)
    assert some.has_maximum_size()
    assert not of.UnboundedSequence(short).has_maximum_size()
    assert of.NamespacedType(["std_msgs", "msg"], "String").namespaced_name() == ("std_msgs", "msg", "String")


def test_a_field_without_ros_type_is_an_error() -> None:
    """The text names the field."""
    with pytest.raises(TypeError, match="'value'"):
        _ = Odd.SLOT_TYPES
