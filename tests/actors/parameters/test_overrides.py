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
    path.write_text(text)
    return load_parameter_file(path)


@pytest.mark.parametrize(
    ("text", "pattern", "name", "value"),
    [
        ("foo:=bar", "/**", "foo", "bar"),
        ("foo.bar:=1", "/**", "foo.bar", 1),
        ("node:foo:=bar", "/**/node", "foo", "bar"),
        ("foo:=a:=b", "/**", "foo", "a:=b"),
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
    """A value for all nodes, or for nodes of one name."""
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
    """Files that were joined may have a key twice, also beside aliases; the order is that of the file."""
    path = tmp_path / "p.yaml"
    path.write_text(
        "/**: &all {ros__parameters: {a: 1, b: 1}}\n"
        "ns: {talker: {ros__parameters: {a: 2}}}\n"
        "/**: {ros__parameters: {a: 3}}\n"
        "ns: {listener: *all}\n"
    )
    entries = load_parameter_file(path)
    assert overrides_for(entries, "/ns/talker") == {"a": 3, "b": 1}
    assert [(each.pattern, each.name) for each in entries[-2:]] == [
        ("/ns/listener", "a"),
        ("/ns/listener", "b"),
    ]


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
        ("", "must hold"),
        ("talker: 5", "must hold"),
        ("talker:", "must hold"),
        ("talker: {speed: 5}", "must hold"),
        ("ros__parameters: {a: 1}", "without a node name"),
        ("talker: {ros__parameters: {a: 1}, b: {ros__parameters: {a: 1}}}", "beside other nodes"),
        ("a b: {ros__parameters: {a: 1}}", "not a node name"),
        ("a: {ros__parameters: {x: }}", "parameter x of /a has no value"),
        ("a: {ros__parameters: {x: [1, two]}}", "not one of the allowed types"),
        ("a: {ros__parameters: {x: 2020-01-01}}", "not one of the allowed types"),
        ("a: {ros__parameters: {x: 99999999999999999999}}", "line 1: the number 9+ is out of range"),
        ("a: [", "expected"),
        ("a: !!python/object/apply:os.system [ls]", "could not determine a constructor"),
        ("\x00", "characters are not allowed"),
        ("[" * 1000, "line 1: it is nested deeper than 100"),
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


def test_aliases_cannot_explode(tmp_path: Path) -> None:
    """A few lines of aliases that stand for millions of parameters are refused."""
    lines = ["x0: &x0 {ros__parameters: {a: 1}}"]
    bomb = ["n:", "  ros__parameters:", "    l0: &l0 {a: 1, b: 2}"]
    bomb += [f"    l{n}: &l{n} {{{', '.join(f'k{k}: *l{n - 1}' for k in range(9))}}}" for n in range(1, 9)]
    assert len(load(tmp_path, "\n".join(lines))) == 1
    with pytest.raises(InvalidParameterFileError, match="line 7: aliases add more than 100000 values"):
        load(tmp_path, "\n".join(bomb))
