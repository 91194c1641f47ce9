"""Definitions of types in bags: of classes as text, and of text as classes."""

from __future__ import annotations

import pytest

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.catalog import interfaces_of, standard_packages
from actors.interfaces.definition_texts import (
    ROS2IDL,
    ROS2MSG,
    canonical_definition,
    class_of_definition,
    definition_text,
)
from actors.interfaces.errors import InterfaceSyntaxError, InvalidMessageError, UnknownInterfaceError
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.message import Message, definition, type_hash, type_name
from actors.interfaces.registry import find_interface
from actors.interfaces.std_msgs.msg import Empty, Header
from tests.interfaces.random_messages import message_classes

LINE = "=" * 80


class Reading(Message, type_name="lab_msgs/msg/Reading"):
    """A type without a `.msg` file."""

    sensor: str = ""
    stamp: Time = Time()


def test_definition_has_all_that_a_type_contains() -> None:
    """The text of a class without a file has each contained type behind a heading."""
    assert definition_text(Reading) == (
        f"string sensor\nbuiltin_interfaces/Time stamp\n{LINE}\nMSG: builtin_interfaces/Time\n"
        "int32 sec\nuint32 nanosec\n"
    )


def test_every_standard_type_survives_its_definition() -> None:
    """The text of each standard message, service part and action part defines the same type, by its hash."""
    names = [name for package in standard_packages() for name in interfaces_of(package)]
    classes = [cls for name in names for cls in message_classes(find_interface(name))]
    assert len(classes) > 300
    for cls in classes:
        found = canonical_definition(type_name(cls), definition_text(cls), ROS2MSG)
        assert found == definition(cls), type_name(cls)


def test_installed_class_is_used_if_it_is_the_same() -> None:
    """A definition that equals an installed class gives that class, another one a new class."""
    text = definition_text(Header)
    assert class_of_definition("std_msgs/msg/Header", text, ROS2MSG) is Header
    assert class_of_definition("std_msgs/Header", text, ROS2MSG) is Header
    other = class_of_definition("std_msgs/msg/Header", "uint32 seq\n" + text, ROS2MSG)
    assert other.__struct_fields__ == ("seq", "stamp", "frame_id")


def test_service_text_defines_the_message_of_an_event() -> None:
    """rosbag2 writes a service's text for its events, and an action's for its feedback."""
    event = class_of_definition(
        "example_interfaces/srv/AddTwoInts_Event", "int64 a\nint64 b\n---\nint64 sum\n", ROS2MSG
    )
    assert type_hash(event) == type_hash(AddTwoInts.Event)
    feedback = class_of_definition(
        "example_interfaces/action/Fibonacci_FeedbackMessage",
        "int32 order\n---\nint32[] sequence\n---\nint32[] sequence\n",
        ROS2MSG,
    )
    assert type_hash(feedback) == type_hash(Fibonacci.Impl.FeedbackMessage)


def test_idl_definitions_are_read() -> None:
    """`ros2idl` has a heading before each part, the type itself included, in any order."""
    inner = (
        f"{LINE}\nIDL: lab_msgs/msg/Inner\n"
        "module lab_msgs { module msg { struct Inner { double x; }; }; };\n"
    )
    outer = (
        f"{LINE}\nIDL: lab_msgs/msg/Outer\nmodule lab_msgs {{ module msg {{ struct Outer {{"
        " sequence<lab_msgs::msg::Inner, 3> inner; }; }; };\n"
    )
    for text in (outer + inner, inner + outer):
        made = class_of_definition("lab_msgs/msg/Outer", text, ROS2IDL)
        assert type_name(made) == "lab_msgs/msg/Outer"
        assert made.get_fields_and_field_types() == {"inner": "sequence<lab_msgs/Inner, 3>"}


def test_missing_definition_is_found_here_or_refused() -> None:
    """Without a text the installed class is used; an unknown type is an error that names it."""
    assert class_of_definition("std_msgs/msg/Empty", "", ROS2MSG) is Empty
    assert class_of_definition("std_msgs/msg/Header", "", "") is Header
    assert class_of_definition("lab_msgs/msg/Nothing", "", ROS2MSG).__struct_fields__ == ()
    with pytest.raises(UnknownInterfaceError, match="no definition of lab_msgs/msg/Unknown"):
        class_of_definition("lab_msgs/msg/Unknown", "", "unknown")


def test_standard_types_need_not_be_defined() -> None:
    """Some writers leave out the types of builtin_interfaces."""
    made = class_of_definition("lab_msgs/msg/At", "builtin_interfaces/Time at\n", ROS2MSG)
    assert made.get_fields_and_field_types() == {"at": "builtin_interfaces/Time"}


@pytest.mark.parametrize(
    ("text", "error", "reason"),
    [
        ("lab_msgs/B b\n", InvalidMessageError, "does not define lab_msgs/msg/B"),
        (f"A[] a\n{LINE}\nMSG: lab_msgs/A\nA[] a\n", InvalidMessageError, "contains itself"),
        (f"B b\n{LINE}\nMSG: lab_msgs/B\nlab_msgs/A a\n", InvalidMessageError, "contains itself"),
        ("int32[99999999999] x\n", InterfaceSyntaxError, "size"),
        (f"B[1000000] b\n{LINE}\nMSG: lab_msgs/B\nint32[1000000] a\n", InvalidMessageError, "elements"),
        ("int32 __class__\n", InterfaceSyntaxError, "field name"),
        ("int32 x\nimport os\n", InterfaceSyntaxError, "import"),
        ("#" * ((1 << 20) + 1), InterfaceSyntaxError, "more than"),
        (f"{LINE}\nMSG: lab_msgs/B\n" * 501, InterfaceSyntaxError, "more than 500 types"),
        (f"int32 x\n{LINE}\nMSG: ../../etc/passwd\nint32 x\n", InterfaceSyntaxError, "Expected a type name"),
    ],
)  # fmt: skip
def test_hostile_definitions_are_refused(text: str, error: type[Exception], reason: str) -> None:
    """Case 95: cycles, sizes without end and what is no definition are errors that say what is wrong."""
    with pytest.raises(error, match=reason):
        class_of_definition("lab_msgs/msg/A", text, ROS2MSG)


@pytest.mark.parametrize("name", ["", "String", "a/b/c/d", "../msg/X", "a/", "std_msgs/msg/", "a/other/X"])
@pytest.mark.parametrize("text", ["", "int32 x\n"])
def test_what_is_no_type_name_is_refused(name: str, text: str) -> None:
    """A name of another form is an InterfaceSyntaxError, with a definition and without."""
    with pytest.raises(InterfaceSyntaxError):
        class_of_definition(name, text, ROS2MSG)
