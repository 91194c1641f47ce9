"""Parameter overrides: inline rules, files, and which nodes they are for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.parameters.errors import InvalidParameterFileError
from actors.parameters.overrides import (
    MAX_FILE_SIZE,
    ParameterOverride,
    load_parameter_file,
    node_matches,
    overrides_for,
)

if TYPE_CHECKING:
    from pathlib import Path


def load(tmp_path: Path, text: str) -> tuple[ParameterOverride, ...]:
    path = tmp_path / "parameters.yaml"
    path.write_text(text, errors="surrogatepass")
    return load_parameter_file(path)


@pytest.mark.parametrize(
    ("text", "pattern", "name", "value"),
    [
        ("foo:=bar", "/**", "foo", "bar"),
        ("foo.bar:=1", "/**", "foo.bar", 1),
        ("node:foo:=bar", "/**/node", "foo", "bar"),
        ("foo:=a:=b", "/**", "foo", "a:=b"),
        ("gain:=1e-3", "/**", "gain", 0.001),
        ("at:=12:30", "/**", "at", "12:30"),
        ("on:=on", "/**", "on", True),
        ("a:='on'", "/**", "a", "on"),
        ("a:=''", "/**", "a", ""),
        ("a:=!!str 1", "/**", "a", "1"),
        ("a:=[1, 0x10]", "/**", "a", [1, 16]),
        ("a:=[]", "/**", "a", []),
        ("a:=[y, 'n']", "/**", "a", None),
        ("a:=two words # and a comment", "/**", "a", "two words"),
        ("a:=-", "/**", "a", None),
        ("~/foo:=~/bar", "/**", "~/foo", "~/bar"),
        ("/foo123:=/bar123", "/**", "/foo123", "/bar123"),
        (
            "qos_overrides./foo/bar.publisher.history:=keep_last",
            "/**",
            "qos_overrides./foo/bar.publisher.history",
            "keep_last",
        ),
    ],
)
def test_inline(text: str, pattern: str, name: str, value: object) -> None:
    """A value for all nodes, or for nodes of one name, by rcl's rules."""
    if value is None:
        with pytest.raises(ValueError, match=r"one type|no value"):
            ParameterOverride.parse(text)
        return
    assert ParameterOverride.parse(text) == ParameterOverride(pattern, name, value)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "foo",
        ":=",
        "foo:=",
        ":=bar",
        "1:=",
        "1:=2",
        "__node:=",
        "}foo:=/bar",
        "f oo:=/bar",
        ":a:=b",
        "~:a:=b",
    ],
)
def test_bad_inline(text: str) -> None:
    """What is no parameter rule is a ValueError."""
    with pytest.raises(ValueError, match=r"expected name:=value|Invalid node name"):
        ParameterOverride.parse(text)


@pytest.mark.parametrize(
    ("pattern", "node", "matches"),
    [
        ("/**", "/n", True),
        ("/**", "/a/b/n", True),
        ("/*", "/n", True),
        ("/*", "/a/n", False),
        ("/*/n", "/a/n", True),
        ("/a/**", "/a/b/n", True),
        ("/a/**", "/b/n", False),
        ("/**/n", "/n", True),
        ("/**/n", "/a/b/n", True),
        ("/**/n", "/a/n/m", False),
        ("/n", "/a/n", False),
        ("/**/foo/*/bar", "/a/b/c/foo/d/bar", True),
        ("/**/foo/*/bar", "/foo/bar", False),
        ("/**/foo/**/bar", "/foo/x/foo/y/bar", True),
    ],
)
def test_wildcards(pattern: str, node: str, matches: bool) -> None:
    """`*` is one part, `**` any number of parts."""
    assert node_matches(pattern, node) is matches


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ("[1, 2.0]", r"the list of value \[1, 2.0\] has an integer and a double; all must have one type"),
        ("[[1], [2]]", "cannot be a list, or have one in a list"),
        ("{a: 1}", "cannot be a mapping"),
        ("a: b", "cannot be a mapping"),
        ("*a", "no aliases"),
        ("[1", "expected"),
        ("# nothing", "there is no value"),
        ("1\n--- 2", "more than one value"),
    ],
)
def test_bad_inline_value(value: str, reason: str) -> None:
    """What rcl refuses as a value, or reads as another one, is an error and no string."""
    with pytest.raises(ValueError, match=reason):
        ParameterOverride.parse(f"a:={value}")


def test_hostile_pattern_is_quick() -> None:
    """A pattern of many wildcards is matched without backtracking."""
    assert not node_matches("/**/a" * 200 + "/b", "/a" * 2000)


def test_later_entries_win(tmp_path: Path) -> None:
    """Of several matching entries the later one wins, whichever is more exact."""
    overrides = load(
        tmp_path,
        """
/ns/talker:
  ros__parameters: {a: 1, b: 1}
/**:
  ros__parameters: {a: 2}
/other:
  ros__parameters: {a: 3}
""",
    )
    assert overrides_for(overrides, "/ns/talker") == {"a": 2, "b": 1}
    assert overrides_for(overrides, "/other") == {"a": 3}


def test_sections_of_one_name_add_up(tmp_path: Path) -> None:
    """Files that were joined may have a key twice, and several documents; the order is that of the file."""
    entries = load(
        tmp_path,
        "/**: {ros__parameters: {a: 1, b: 1}}\n"
        "ns: {talker: {ros__parameters: {a: 2}}}\n"
        "/**: {ros__parameters: {a: 3}}\n"
        "---\n"
        "ns: {listener: {ros__parameters: {a: 4, a: x}}}\n",
    )
    assert overrides_for(entries, "/ns/talker") == {"a": 3, "b": 1}
    assert overrides_for(entries, "/ns/listener") == {"a": "x", "b": 1}


@pytest.mark.parametrize("text", ["", "# only a comment\n", "{}", "talker: {}", "/**: {ros__parameters: {}}"])
def test_files_without_parameters(tmp_path: Path, text: str) -> None:
    """As ROS 2 has it, an empty file and one of comments only have no parameters."""
    assert load(tmp_path, text) == ()


def test_keys_are_texts(tmp_path: Path) -> None:
    """A name that would be a value of another type is a name all the same."""
    entries = load(
        tmp_path,
        "on: {ros__parameters: {on: 1, 010: 2, 1.5: 3, null: 4, 2020-01-01: 5, y: {no: 6}, '<<': 7}}",
    )
    assert overrides_for(entries, "/on") == {
        "on": 1,
        "010": 2,
        "1.5": 3,
        "null": 4,
        "2020-01-01": 5,
        "y.no": 6,
        "<<": 7,
    }


def test_scalars_follow_rcl(tmp_path: Path) -> None:
    """Quotes and `!!str` make a string, block scalars do not; other tags and anchors mean nothing."""
    entries = load(
        tmp_path,
        """
/**:
  ros__parameters:
    gain: 1e-3
    time: 12:30
    date: 2020-01-01
    none: null
    many: 1_000
    quoted: ['1', "2"]
    tagged: !!str 1
    other: !!int "1"
    anchor: &a y
    block: |-
      1
    folded: >
      1
    big: 99999999999999999999
    data: !!binary aGk=
""",
    )
    assert overrides_for(entries, "/n") == {
        "gain": 0.001,
        "time": "12:30",
        "date": "2020-01-01",
        "none": "null",
        "many": "1_000",
        "quoted": ["1", "2"],
        "tagged": "1",
        "other": "1",
        "anchor": True,
        "block": 1,
        "folded": "1\n",
        "big": 1e20,
        "data": b"hi",
    }


def test_file_form(tmp_path: Path) -> None:
    """Nested maps flatten with dots, nested namespaces join, the first slash may be missing."""
    overrides = load(
        tmp_path,
        """
talker:
  ros__parameters:
    text: hello
    rates: {slow: 1.5, deep: {er: [1, 2]}}
    empty: {}
ns:
  listener:
    ros__parameters: {flag: true}
""",
    )
    assert overrides_for(overrides, "/talker") == {
        "text": "hello",
        "rates.slow": 1.5,
        "rates.deep.er": [1, 2],
    }
    assert overrides_for(overrides, "/ns/listener") == {"flag": True}
    assert overrides_for(overrides, "/ns/talker") == {}


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("null", "must hold"),
        ("[talker]", "must hold"),
        ("---\n---\na: {ros__parameters: {a: 1}}", "must hold"),
        ("talker: 5", "must hold"),
        ("talker:", "must hold"),
        ("talker: {speed: 5}", "must hold"),
        ("ros__parameters: {a: 1}", "needs the name of a node above it"),
        ("talker: {ros__parameters: }", "must hold"),
        ("talker: {ros__parameters: [{a: 1}, {b: 2}]}", "must hold"),
        ("a b: {ros__parameters: {a: 1}}", "not a node name"),
        ("/a: {/b: {ros__parameters: {a: 1}}}", "'/a//b' is not a node name"),
        ("1a: {ros__parameters: {a: 1}}", "not a node name"),
        ("a: {ros__parameters: {'': 1}}", "a key must be a word"),
        ("a: {ros__parameters: {[b]: 1}}", "a key must be a word"),
        ("a: {ros__parameters: {x: }}", "parameter x of /a has no value"),
        ("a: {ros__parameters: {x: [1, two]}}", "list of parameter x of /a has an integer and a string; all"),
        ("a: {ros__parameters: {x: [[1]]}}", "parameter x of /a cannot be a list, or have one in a list"),
        ("a: {ros__parameters: {x: [{b: 1}, {c: 2}]}}", "parameter x of /a cannot be a mapping"),
        ("a: {ros__parameters: {x: !!binary a}}", "parameter x of /a is not base64"),
        ("a: {ros__parameters: {x: &x 1, y: *x}}", "line 1: parameter files have no aliases"),
        ("a: {ros__parameters: {<<: {x: 1}}}", "parameter files have no merge keys"),
        ("a: [", "expected"),
        ("a: !!python/object/apply:os.system [ls]", "must hold"),
        ("a: \ud800", "."),
        ("a: {" * 200, "line 1: it is nested deeper than 100"),
        ("a: {ros__parameters: {" + "b: {" * 200, "line 1: it is nested deeper than 100"),
        ("\x00", "characters are not allowed"),
        ("[" * 1000, "must hold"),
    ],
)
def test_bad_files(tmp_path: Path, text: str, reason: str) -> None:
    """A file of another form is an error that names the file and says what is wrong."""
    with pytest.raises(InvalidParameterFileError, match=reason) as caught:
        load(tmp_path, text)
    assert "parameters.yaml" in str(caught.value)
    assert str(caught.value).isprintable()


def test_unreadable_files(tmp_path: Path) -> None:
    """A missing file, a directory and a huge file are errors, not crashes."""
    with pytest.raises(InvalidParameterFileError, match="No such file"):
        load_parameter_file(tmp_path / "missing.yaml")
    with pytest.raises(InvalidParameterFileError, match="directory"):
        load_parameter_file(tmp_path)
    with pytest.raises(InvalidParameterFileError, match="larger than"):
        load(tmp_path, "#" * (MAX_FILE_SIZE + 1))
