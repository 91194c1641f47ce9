"""`.idl` files: the part of IDL that ROS 2 reads."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.interfaces.errors import InterfaceSyntaxError
from actors.interfaces.idl import parse_idl
from actors.interfaces.parser import parse, parse_file
from actors.interfaces.specs import interface_text

if TYPE_CHECKING:
    from pathlib import Path

    from actors.interfaces.specs import InterfaceSpec

WHEEL = """// A file
#include "std_msgs/msg/Header.idl"
#include <geometry_msgs/msg/Point.idl>
module robot_msgs {
  module msg {
    typedef double triple[3];
    typedef geometry_msgs::msg::Point Point;
    typedef Point points[2];
    typedef string<5> tag;
    enum Side { LEFT, @value(5) RIGHT };
    struct Later;
    module Wheel_Constants {
      @verbatim (language="comment", text="The left " "one")
      const uint8 LEFT = 1;
      const short LOW = -5;
      const float HALF = .5;
      const boolean ON = TRUE;
      const string NAME = "a\\"b" "\\x41";
      const wstring WIDE = L"\\u00fc";
      const octet BYTE = 255;
    };
    module Other { const long IGNORED = 1; };
    /* The
       wheel */
    @verbatim (language="comment", text=
      "One of the wheels." "\\n"
      "" "\\n"
      "  Of a robot.")
    @transfer_mode(SHMEM_REF)
    struct Wheel {
      @verbatim (language="comment", text="From the axis")
      @unit (value="m")
      @default (value=0.5)
      double radius, width;
      @key long id;
      std_msgs::msg::Header header;
      triple offset;
      points both;
      sequence<Point, 3> few;
      sequence<tag> tags;
      @default (value="(1, 2)")
      sequence<unsigned short, 4> numbers;
      @default (value="('a', 'it\\\\'s')")
      sequence<string> texts;
      unsigned long long big[2];
      long long signed_one;
      octet raw;
      wstring<7> wide;
      ::robot_msgs::msg::Axle axle;
    };
  };
};
"""
WHEEL_MSG = """# One of the wheels.
#
#   Of a robot.

uint8 LEFT=1  # The left one
int16 LOW=-5
float32 HALF=0.5
bool ON=true
string NAME="a\\"bA"
wstring WIDE="ü"
byte BYTE=255
float64 radius 0.5  # From the axis [m]
float64 width 0.5  # From the axis [m]
int32 id
std_msgs/Header header
float64[3] offset
geometry_msgs/Point[2] both
geometry_msgs/Point[<=3] few
string<=5[] tags
uint16[<=4] numbers [1, 2]
string[] texts ["a", "it's"]
uint64[2] big
int64 signed_one
byte raw
wstring<=7 wide
robot_msgs/Axle axle
"""


def idl(body: str) -> InterfaceSpec:
    """Parse the definitions of a module of messages; the first line of `body` is line 2."""
    return parse_idl(f"module a_msgs {{ module msg {{\n{body}\n}}; }};", "a_msgs", "msg", "Foo", "Foo.idl")


def test_a_message() -> None:
    """All that ROS 2 reads: the same as in a `.msg` file, with comments, units and defaults."""
    spec = parse_idl(WHEEL, "robot_msgs", "msg", "Wheel")
    assert interface_text(spec) == WHEEL_MSG
    assert spec == parse(WHEEL_MSG, "robot_msgs", "msg", "Wheel")


def test_services_and_actions() -> None:
    """A struct for each part, in a module for each kind; constants belong to their part."""
    text = """module a_msgs { module srv {
        module Do_Response_Constants { const int8 OK = 1; };
        struct Do_Request { uint8 structure_needs_at_least_one_member; };
        struct Do_Response { a_msgs::msg::B b; };
    }; };"""
    spec = parse_idl(text, "a_msgs", "srv", "Do")
    assert interface_text(spec) == "---\nint8 OK=1\na_msgs/B b\n"
    text = "module a_msgs { module action { %s }; };" % " ".join(  # noqa: UP031 - braces
        f"struct Go_{part} {{ long x; }};" for part in ("Goal", "Result", "Feedback")
    )
    spec = parse_idl(text, "a_msgs", "action", "Go")
    assert interface_text(spec) == "int32 x\n---\nint32 x\n---\nint32 x\n"


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("struct Foo { char c; };", "cannot send a char"),
        ("struct Foo { wchar c; };", "cannot send a wchar"),
        ("struct Foo { long double d; };", "cannot send a long double"),
        ("struct Foo { long x[2][3]; };", "two dimensions"),
        ("struct Foo { sequence<sequence<long>> x; };", "sequence of sequences"),
        (f"struct Foo {{ {'sequence<' * 5000}long{'>' * 5000} x; }};", "sequence of sequences"),
        ("struct Foo { sequence<long> x[2]; };", "array of sequences"),
        ("struct Foo { Bar x; };", "'Bar' is no type defined above"),
        ("struct Foo { a_msgs::srv::Bar x; };", "no message, such as"),
        ("enum E { A }; struct Foo { E x; };", "is an enum"),
        ("struct Foo : Bar { long x; };", "has a base"),
        ("struct Foo { };", "structure_needs_at_least_one_member"),
        ("struct Foo { long x; long x; };", "already defined"),
        ("struct Foo { long lambda; };", "Python keyword"),
        ("struct Foo { string<0> x; };", "from 1 to"),
        ("struct Foo { long x[N]; };", "from 1 to 4294967295, got N"),
        ("struct Foo { sequence<long, 010> x; };", "from 1 to 4294967295, got 010"),
        (f"struct Foo {{ string<{'9' * 5000}> x; }};", "from 1 to"),
        ("struct Foo { @default(5) long x; };", "'x' has no value; write"),
        (f"struct Foo {{ @default(value={'9' * 5000}) double x; }};", "no value that ROS 2 reads"),
        ("module Foo_Constants { const long None = 1; }; struct Foo { long x; };", "Python keyword"),
        ("struct Foo { long x[99999999]; };", "at most"),
        ("struct Foo { @default(value=300) uint8 x; };", "out of range"),
        ("struct Foo { @default(value=TRUE) long x; };", "expected a number"),
        ('struct Foo { @default(value="x") long x; };', "'x' is not a value of type int32"),
        ('struct Foo { @default(value="(1, 2") sequence<long> x; };', "is not a value"),
        ("union Foo switch (long) { case 1: long x; };", "'union' has no meaning in ROS 2"),
        ("interface Foo { };", "no meaning"),
        ("long x;", "'long' is no definition"),
        ("const long X = 2 + 3; struct Foo { long x; };", r"Expected ';', got \+"),
        ("const long X = 0x10; struct Foo { long x; };", "0x10 is no value"),
        ("const sequence<long> X = 1; struct Foo { long x; };", "primitive type"),
        ("struct Foo { long x }", "Expected ';', got }"),
        ("struct Foo { long ", "Expected a name"),
        ("typedef long a, b; struct Foo { long x; };", "one name"),
        ("typedef long a; typedef short a; struct Foo { long x; };", "already another type"),
        ("#define X 1", "#include"),
        ("struct Foo { 'x' };", "Expected a name, got '"),
        ("struct Foo { long é; };", "is not IDL"),
    ],
)
def test_everything_else_is_refused(body: str, reason: str) -> None:
    """With the line, and a sentence that says what to write."""
    with pytest.raises(InterfaceSyntaxError, match=reason) as caught:
        idl(f"\n{body}")
    assert caught.value.line in {3, 4}
    assert str(caught.value).startswith("Foo.idl:")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "has the structs Foo; this has none"),
        ("module a_msgs { module msg { struct Bar { long x; }; }; };", "this has Bar"),
        ("module a_msgs { module srv { struct Foo { long x; }; }; };", "module a_msgs and in it module msg"),
        ("module b { module msg { struct Foo { long x; }; }; };", "module a_msgs and in it module msg"),
        (
            """module a_msgs { module msg {
            module Foo_Constants { const long x = 1; }; struct Foo { long x; }; }; };""",
            "'x' is a constant and a field",
        ),
        ("module m {" * 100, "levels deep"),
        ("module m { };", "Expected a name"),
    ],
)
def test_a_file_defines_what_its_name_says(text: str, reason: str) -> None:
    """Package, kind and name are those of the folders and the file."""
    with pytest.raises(InterfaceSyntaxError, match=reason):
        parse_idl(text, "a_msgs", "msg", "Foo")


def test_numbers_keep_their_value() -> None:
    """However long they are, and with either sign."""
    body = f"@default(value={'1' * 40}) double long_one; @default(value=+5) long plus; long size[12];"
    large, plus, _ = idl(f"struct Foo {{ {body} }};").parts[0].fields
    assert (large.default, plus.default) == (1.1111111111111112e39, 5)


def test_files_are_read_by_their_suffix(tmp_path: Path) -> None:
    """The kind is that of the folder."""
    path = tmp_path / "robot_msgs" / "msg" / "Wheel.idl"
    path.parent.mkdir(parents=True)
    path.write_text(WHEEL)
    assert parse_file(path, "robot_msgs").type_name == "robot_msgs/msg/Wheel"


_WORDS = st.sampled_from(
    [*"{}()<>[];,=@-", "::", *WHEEL.split(), '"a"', "1", "2.5", "\n", "const", "typedef", "x"]
)  # fmt: skip


@given(st.lists(_WORDS, max_size=30).map(" ".join) | st.text())
def test_any_text_is_read_or_refused(text: str) -> None:
    """Without another error, and without an end that is not found."""
    for whole in (text, f"module a_msgs {{ module msg {{ struct Foo {{ {text} }}; }}; }};"):
        with contextlib.suppress(InterfaceSyntaxError):
            parse_idl(whole, "a_msgs", "msg", "Foo")
