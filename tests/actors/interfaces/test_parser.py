"""`.msg`, `.srv` and `.action` text."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.interfaces.errors import InterfaceSyntaxError
from actors.interfaces.parser import MAX_FILE_BYTES, parse, parse_file
from actors.interfaces.specs import MAX_FIELDS, InterfaceSpec

if TYPE_CHECKING:
    from pathlib import Path


def msg(text: str) -> InterfaceSpec:
    return parse(text, "a_msgs", "msg", "Foo", "Foo.msg")


def fields(text: str) -> list[str]:
    return [f"{field.type} {field.name}" for field in msg(text).parts[0].fields]


@pytest.mark.parametrize("name", ["foo", "foo_bar", "foo2", "a"])
def test_good_field_names(name: str) -> None:
    """Lower case, single underscores."""
    assert fields(f"bool {name}") == [f"bool {name}"]


@pytest.mark.parametrize("name", ["_foo", "foo_", "foo__bar", "foo-bar", "Foo", "0foo", "fooBar", "class"])
def test_bad_field_names(name: str) -> None:
    """The error has file, line, name and remedy; Python's keywords are refused, too."""
    with pytest.raises(InterfaceSyntaxError, match=rf"Foo\.msg:2: .*{name}.*use"):
        msg(f"\nbool {name}")


@pytest.mark.parametrize("name", ["Foo", "FooBar", "Imu2"])
def test_good_message_names(name: str) -> None:
    """CamelCase."""
    assert parse("", "a_msgs", "msg", name).type_name == f"a_msgs/msg/{name}"


@pytest.mark.parametrize("name", ["foo", "Foo_Bar", "0Foo", "Foo-Bar", "", "None"])
def test_bad_message_names(name: str) -> None:
    """Anything else."""
    with pytest.raises(InterfaceSyntaxError):
        parse("", "a_msgs", "msg", name)


@pytest.mark.parametrize("package", ["Foo", "foo_", "foo__bar", "_foo", "0foo", "foo-bar", "class", ""])
def test_bad_package_names(package: str) -> None:
    """Package names follow the rule of field names."""
    with pytest.raises(InterfaceSyntaxError):
        parse("", package, "msg", "Foo")


def test_fields_defaults_and_constants() -> None:
    """`bool foo`, `bool foo 1` and `bool FOO=1`; constants with spaces, too."""
    spec = msg("bool foo\nbool bar 1\nbool FOO=1\nint8  LOW = -0x10 # low\nstring\tS=a=b").parts[0]
    assert [(field.name, field.default) for field in spec.fields] == [("foo", None), ("bar", True)]
    assert [(c.name, c.value) for c in spec.constants] == [("FOO", True), ("LOW", -16), ("S", "a=b")]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("bool foo=1", "not a constant's name"),
        ("bool", "no name"),
        ("bool FOO_=1", "not a constant's name"),
        ("bool _FOO=1", "constant"),
        ("bool FOO__BAR=1", "constant"),
        ("bool a\nint8 a", "already defined in line 1"),
        ("int8 A=1\nint8 A=2", "already defined"),
        ("bool[2] A=[1,0]", "primitive"),
        ("b_msgs/X A=1", "primitive"),
        ("string<=3 A=abc", "primitive"),
        ("b_msgs/X x 1", "default"),
        ("int8 x 128", "out of range"),
        ("bool x 5", "not a bool"),
        ("foo x", "CamelCase"),
        ("time stamp", "builtin_interfaces/Time"),
        ("int8[0] x", "1 to"),
        ("int8[n] x", "1 to"),
        ("int8[<=] x", "1 to"),
        ("int8[-1] x", "1 to"),
        ("int8<=3 x", "only string"),
        ("string<= x", "1 to"),
        ("int8[5 x", "not a type"),
        ("Pkg/Foo x", "package name"),
        ("a/b/c/D x", "not a type"),
        ("int8[] x 1", "array"),
        ("int8[2] x [1]", "elements"),
        ("string<=2 x abc", "longer"),
        ("int8[99999999] x", "at most"),
        (f"int8[{'9' * 5000}] x", "1 to"),
    ],
)
def test_errors_say_where_and_why(text: str, reason: str) -> None:
    """ROS has NameError, ValueError and TypeError here; callboard one type with the line."""
    with pytest.raises(InterfaceSyntaxError, match=reason) as caught:
        msg(text)
    assert caught.value.line == text.count("\n") + 1
    assert str(caught.value).startswith(f"Foo.msg:{caught.value.line}: ")


def test_types() -> None:
    """Arrays, bounds, both, other packages' messages, this package's, and Header."""
    assert fields(
        "int8[] a\nint8[5] b\nint8[<=5] c\nstring<=10 d\nstring<=10[<=5] e\nwstring f\nPose g\n"
        "geometry_msgs/Pose[2] h\ngeometry_msgs/msg/Pose i\nHeader j"
    ) == [
        "int8[] a",
        "int8[5] b",
        "int8[<=5] c",
        "string<=10 d",
        "string<=10[<=5] e",
        "wstring f",
        "a_msgs/Pose g",
        "geometry_msgs/Pose[2] h",
        "geometry_msgs/Pose i",
        "std_msgs/Header j",
    ]


def test_a_package_may_have_a_header_of_its_own(tmp_path: Path) -> None:
    """Then `Header` alone is that message, as every name without a package; std_msgs's must be named."""
    folder = tmp_path / "a_msgs" / "msg"
    folder.mkdir(parents=True)
    (folder / "Scan.msg").write_text("Header header\nstd_msgs/Header other\nHeader[2] both")
    types = [field.type.base for field in parse_file(folder / "Scan.msg", "a_msgs").parts[0].fields]
    assert types == ["std_msgs/msg/Header", "std_msgs/msg/Header", "std_msgs/msg/Header"]
    (folder / "Header.msg").write_text("int8 x")
    types = [field.type.base for field in parse_file(folder / "Scan.msg", "a_msgs").parts[0].fields]
    assert types == ["a_msgs/msg/Header", "std_msgs/msg/Header", "a_msgs/msg/Header"]


def test_sizes_are_read_as_rosidl_reads_them() -> None:
    """With Python's `int`. A fixed array may be as large as a message."""
    texts = ["int8[1_000] a", "string<=+5 b", "int8[<=007] c", "uint8[2097152] d", "uint8[67108864] e"]
    assert fields("\n".join([*texts, f"int8[{'0' * 18}123] f"])) == [
        "int8[1000] a", "string<=5 b", "int8[<=7] c", "uint8[2097152] d", "uint8[67108864] e", "int8[123] f"
    ]  # fmt: skip


def test_comments_end_lines_but_not_strings() -> None:
    """A `#` in quotes is text."""
    spec = msg('# one\n  # two\nstring a "x # y" # three\nstring b don\'t # four\nint8 c#five').parts[0]
    assert [field.default for field in spec.fields] == ["x # y", "don't", None]
    assert msg("string A=it's # it's").parts[0].constants[0].value == "it's"


def test_services_and_actions_have_parts() -> None:
    """Two and three, any of them empty."""
    service = parse("int64 a\n---\nint64 sum", "a_msgs", "srv", "Add")
    assert [len(part.fields) for part in service.parts] == [1, 1]
    action = parse("---\n---\n", "a_msgs", "action", "Go")
    assert [len(part.fields) for part in action.parts] == [0, 0, 0]
    for kind, text in (
        ("srv", "int64 a"),
        ("action", "---"),
        ("msg", "---"),
        ("srv", "---\n---"),
        ("idl", ""),
    ):
        with pytest.raises(InterfaceSyntaxError):
            parse(text, "a_msgs", kind, "Foo")


def test_dependencies() -> None:
    """The messages that fields hold, of all parts."""
    spec = parse("Pose a\n---\nb_msgs/Pose[] b\nint8 c", "a_msgs", "srv", "Foo")
    assert spec.dependencies == {"a_msgs/msg/Pose", "b_msgs/msg/Pose"}


def test_limits(tmp_path: Path) -> None:
    """Size of the file, number of fields, encoding."""
    path = tmp_path / "Foo.msg"
    path.write_bytes(b"#" * (MAX_FILE_BYTES + 1))
    with pytest.raises(InterfaceSyntaxError, match="larger"):
        parse_file(path, "a_msgs")
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(InterfaceSyntaxError, match="UTF-8"):
        parse_file(path, "a_msgs")
    path.write_bytes(b"\xef\xbb\xbfint8 a\r\n")
    assert parse_file(path, "a_msgs").name == "Foo"
    with pytest.raises(InterfaceSyntaxError, match="More than"):
        msg("\n".join(f"int8 a{n}" for n in range(MAX_FIELDS + 1)))


@given(st.text(alphabet=st.sampled_from("int8string<=[]\"'#, \n\t/A_b0-9xé\\"), max_size=60))
def test_any_text_parses_or_is_a_syntax_error(text: str) -> None:
    """No other exception comes out."""
    with contextlib.suppress(InterfaceSyntaxError):
        msg(text)
