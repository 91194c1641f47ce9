"""YAML is read within limits, and errors say in which line."""

from __future__ import annotations

from typing import Any, cast

import pytest
import yaml

from actors.interfaces.yaml_reader import PlainText, YamlError, deeper_than, load_yaml
from actors.interfaces.yaml_scalars import rcl_scalar


@pytest.mark.parametrize("text", ["[[[]]]", "{a: {b: {c: 1}}}", "- [{}]", "[a, [[]], b]"])
def test_levels_are_counted(text: str) -> None:
    """Lists and maps alike; the first that is too deep is reported, and where it is."""
    assert deeper_than(3, yaml.parse(text)) is None
    found = deeper_than(2, yaml.parse(text))
    assert text[found.start_mark.index] in "[{c"


def test_what_stands_side_by_side_is_not_deep() -> None:
    """However much of it there is."""
    assert deeper_than(2, yaml.parse(f"[{'[1], ' * 1000}]")) is None


BOMB = "a0: &a0 [x, x]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]\n" for n in range(1, 40))
CHAIN = "a0: &a0 [x]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}]\n" for n in range(1, 200))
MERGES = "a: &a {x: 1}\nb: {" + "<<: *a, " * 2000 + "}"


@pytest.mark.parametrize(
    ("text", "error"),
    [
        (BOMB, "line [0-9]+: aliases add more than 100000 values"),
        (CHAIN, "line [0-9]+: it is nested deeper than 100"),
        (MERGES, "line 2: more than 1000 merged mappings"),
        ("a: &x {b: *x}", "line 1: an alias is part of its own value"),
        ("\n" + "[" * 100_000, "line 2: it is nested deeper than 100"),
        ("a: !!int 1" + ":1" * 100_000, "line 1: a number of more than 1000 characters"),
        ("a: !!int 0x" + "f" * 5000, "line 1: a number of more than 1000 characters"),
        ("a: 18446744073709551616", "line 1: the number 18446744073709551616 is out of range"),
        (
            "a: !!timestamp 2020-01-01 00:00:00 +99:99",
            "line 1: '2020-01-01 00:00:00 .99:99' is not what its tag says",
        ),
        ("a: !!timestamp x", "line 1: 'x' is not what its tag says"),
        ("a: !!bool x", "line 1: 'x' is not what its tag says"),
        ("a: !!int ''", "line 1: '' is not what its tag says"),
        ("b: 1\na: !!float {}", "line 2"),
        ("a: !!python/object:os.system {}", "line 1: could not determine a constructor"),
        ("{[a]: 1}", "line 1: found unhashable key"),
        ("a: [", "line [12]: "),
        ("a: \x07", "characters are not allowed"),
        ("\ud800", "."),
        (b"a: \xff", "."),
        ("a" * 1001, "larger than 1000 bytes"),
    ],
)
def test_hostile_yaml_is_refused_at_once(text: str | bytes, error: str) -> None:
    """Case 59: no hang, no full memory, no error of PyYAML's; one short line says what is wrong."""
    limit = 1000 if error.startswith("larger") else 2**20
    with pytest.raises(YamlError, match=error) as caught:
        load_yaml(text, max_bytes=limit)
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < 600


def test_honest_yaml_is_read() -> None:
    """Aliases, merges, long lists and large numbers of 64 bits."""
    assert load_yaml("a: &a {x: 1}\nb: {<<: *a, y: 2}\nc: [*a, *a]") == {
        "a": {"x": 1},
        "b": {"x": 1, "y": 2},
        "c": [{"x": 1}, {"x": 1}],
    }
    assert load_yaml(f"[{', '.join(['1'] * 200_000)}]") == [1] * 200_000
    assert load_yaml("[18446744073709551615, -9223372036854775808, 1e999]") == [2**64 - 1, -(2**63), "1e999"]
    assert load_yaml(b"") is None


def test_keys_are_texts() -> None:
    """A key is as it is written, also one that a merge brings in."""
    text = "{on: 1, 010: 2, null: 3, 2020-01-01: {y: 4, off: 5}, a: &a {no: 6}, b: {<<: *a, yes: 7}}"
    assert load_yaml(text) == {
        "on": 1,
        "010": 2,
        "null": 3,
        "2020-01-01": {"y": 4, "off": 5},
        "a": {"no": 6},
        "b": {"no": 6, "yes": 7},
    }


def test_scalars_by_rules() -> None:
    """Unquoted scalars follow the rules given; what is quoted or has a tag follows its own."""
    text = "[on, 08, y, 'on', !!str on, !!int '0b11', !!float '1']"
    assert load_yaml(text) == [True, "08", "y", "on", "on", 3, 1.0]
    assert load_yaml(text, rules=rcl_scalar) == [True, 8.0, True, "on", "on", 3, 1.0]
    raw = cast("list[Any]", load_yaml(text, rules=PlainText))
    assert raw == ["on", "08", "y", "on", "on", 3, 1.0]
    assert [isinstance(each, PlainText) for each in raw] == [True] * 3 + [False] * 4
