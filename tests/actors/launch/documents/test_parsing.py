"""Tests of actors.launch.documents.parsing."""

from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.launch.documents.errors import DocumentError, Location
from actors.launch.documents.parsing import MAX_DEPTH, toml_data, yaml_data, yaml_line


def yaml(text: str) -> object:
    return yaml_data(text.encode())


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("", None),
        ("a: 1\nb: [true, 1.5, ~, 'x', 0x10]", {"a": 1, "b": [True, 1.5, None, "x", 16]}),
        ("on: off\n1: a\nno: b", {"on": False, "1": "a", "no": "b"}),
        ("a: 2026-01-01", {"a": "2026-01-01"}),
        ("a: =", {"a": "="}),
        ("a: &x [1]\nb: *x", {"a": [1], "b": [1]}),
        ("a: &x {p: 1, q: 2}\nb: {<<: *x, q: 3}", {"a": {"p": 1, "q": 2}, "b": {"p": 1, "q": 3}}),
        ("<<: [{a: 1}, {a: 2, b: 2}]\nc: 3", {"a": 1, "b": 2, "c": 3}),
        ("\ufeffa: ü", {"a": "ü"}),
    ],
)
def test_yaml_is_plain_data(text: str, meant: object) -> None:
    """Keys are texts as they stand there, dates are texts, and anchors and merges work."""
    assert yaml(text) == meant


@pytest.mark.parametrize(
    ("text", "line", "error"),
    [
        ("a: [1\nb: 2", 2, "it is not YAML: "),
        ("a:\n\t- b", 2, "it is not YAML: "),
        ("a: 1\n---\nb: 2", 2, "it is not YAML: "),
        ("a: 1\nb: 2\na: 3", 3, "the key 'a' is there twice"),
        ("? [a]\n: b", 1, "a key must be a string"),
        (
            "a: !!python/name:os.system x",
            1,
            "the tag tag:yaml.org,2002:python/name:os.system is not known here",
        ),
        ("a: !x [1]", 1, "the tag !x is not known here"),
        ("a: !!binary aGk=", 1, "the tag tag:yaml.org,2002:binary is not known here"),
        ("a: 1\nb: !!int x", 2, "'x' is not what its tag says"),
        ("a: !!bool x", 1, "'x' is not what its tag says"),
        ("<<: 3", 1, "<< takes mappings only"),
        ("a: &x [*x]", 1, "an alias is part of its own value"),
        ("[" * 100_000, 1, f"it is nested deeper than {MAX_DEPTH}"),
        ("a: !!int " + "9" * 10_000, 1, "a number of more than 1000 characters"),
    ],
)
def test_what_is_no_such_yaml_is_an_error(text: str, line: int, error: str) -> None:
    """It says what is wrong, and in which line."""
    with pytest.raises(DocumentError) as caught:
        yaml(text)
    assert caught.value.text.startswith(error)
    assert caught.value.line == line


def test_bytes_that_are_no_text_are_an_error() -> None:
    """In both languages."""
    with pytest.raises(DocumentError, match="it is not YAML"):
        yaml_data(b"a: \xff")
    with pytest.raises(DocumentError, match="it is not UTF-8"):
        toml_data(b"a = '\xff'")


def test_aliases_cannot_stand_for_any_number_of_values() -> None:
    """Ten lists of ten times the one before are refused long before memory is."""
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 10)]
    with pytest.raises(DocumentError, match="aliases add more than 100000 values"):
        yaml("\n".join(lines))
    merged = ["a0: &a0 {x: 1}"]
    merged += [f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 10)}]}}" for i in range(1, 10)]
    with pytest.raises(DocumentError, match="aliases add more than 100000 values"):
        yaml("\n".join(merged))


@pytest.mark.parametrize(
    ("steps", "line"),
    [
        ((), None),
        (("a",), 1),
        (("a", 0), 2),
        (("a", 1, "c"), 4),
        (("a", 1, "c", 2), 4),
        (("a", 1, "merged"), 3),
    ],
)
def test_the_line_of_a_location(steps: tuple[str | int, ...], line: int | None) -> None:
    """It is where the key or the entry stands; if that cannot be found, where what is around it does."""
    assert yaml_line(b"a:\n  - b: 1\n  - b: 2\n    c: [1, 2, 3]\n", Location(steps)) == line


def test_toml_is_plain_data() -> None:
    """Tables, arrays of tables and all scalars."""
    text = b"[[launch]]\n[launch.node]\nscript = 'a.py'\nparameters.x.y = [1, 2.5, true]"
    node = {"script": "a.py", "parameters": {"x": {"y": [1, 2.5, True]}}}
    assert toml_data(text) == {"launch": [{"node": node}]}


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("a = ", r"it is not TOML: Invalid value \(at end of document\)"),
        ("a = 1\na = 2", "it is not TOML: Cannot overwrite a value"),
        ("a = " + "[" * 10_000 + "]" * 10_000, "it is nested too deeply|it is not TOML"),
        ("a = " + "[" * 60 + "]" * 60, f"it is nested deeper than {MAX_DEPTH}"),
    ],
)
def test_what_is_no_such_toml_is_an_error(text: str, error: str) -> None:
    """It says what is wrong; tomllib knows where."""
    with pytest.raises(DocumentError, match=error):
        toml_data(text.encode())


@given(st.binary(max_size=60) | st.text(alphabet="{}[]:-&*x1 \n<!|'\"#", max_size=60).map(str.encode))
def test_any_bytes_are_read_or_refused(source: bytes) -> None:
    """Nothing else than a DocumentError comes of what is strange."""
    for read in (yaml_data, toml_data):
        with suppress(DocumentError):
            read(source)
