"""From definitions back to text."""

from __future__ import annotations

import json
from typing import Any

import pytest

from actors.interfaces.described import texts_of
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import definition
from actors.interfaces.parser import parse
from actors.interfaces.registry import find_interface, source_of
from tests.interfaces.imported import TYPES


def _fields(text: str, name: str) -> list[list[tuple[str, str]]]:
    """Return each part's fields; char is an unsigned byte in a definition."""
    parts = parse(text, *name.split("/")).parts
    return [
        [(field.name, str(field.type).replace("char", "uint8")) for field in part.fields] for part in parts
    ]


@pytest.mark.parametrize("package", TYPES)
def test_every_standard_type_comes_back(package: str) -> None:
    """Field for field, with those of what it contains."""
    for name in (each for each in TYPES[package] if "/action/" not in each):
        cls = find_interface(name)
        texts = texts_of(definition(cls))
        assert _fields(texts[name], name) == _fields(source_of(cls), name)


def test_bounds_come_back() -> None:
    """Of strings, of arrays, and of both."""
    whole = {
        "type_description": {
            "type_name": "robots/msg/All",
            "fields": [
                _field("a", 17),
                _field("b", 21, bound=5),
                _field("c", 21 + 48, capacity=3, bound=5),
                _field("d", 1 + 96, capacity=2, nested="robots/msg/Arm"),
                _field("e", 11 + 144),
            ],
        },
        "referenced_type_descriptions": [],
    }
    assert texts_of(json.dumps(whole).encode())["robots/msg/All"].splitlines() == [
        "string a",
        "string<=5 b",
        "string<=5[3] c",
        "robots/Arm[<=2] d",
        "float64[] e",
    ]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        "[" * 100_000,
        '{"type_description": 1, "referenced_type_descriptions": []}',
        '{"type_description": {"type_name": "a", "fields": [1]}, "referenced_type_descriptions": []}',
        json.dumps({"type_description": {"type_name": "a", "fields": []}, "referenced_type_descriptions": 5}),
    ],
)
def test_what_is_no_definition_is_refused(text: str) -> None:
    """It comes from strangers."""
    with pytest.raises(InvalidMessageError):
        texts_of(text.encode())


@pytest.mark.parametrize("number", [0, 20, 40, 48, 192, 10**30, -1])
def test_unknown_kinds_of_fields_are_refused(number: int) -> None:
    """Rather than shown as something else."""
    whole = {
        "type_description": {"type_name": "a/msg/B", "fields": [_field("x", number)]},
        "referenced_type_descriptions": [],
    }
    with pytest.raises(InvalidMessageError):
        texts_of(json.dumps(whole).encode())


def _field(name: str, type_id: int, *, capacity: int = 0, bound: int = 0, nested: str = "") -> dict[str, Any]:
    kind = {
        "type_id": type_id,
        "capacity": capacity,
        "string_capacity": bound,
        "nested_type_name": nested,
    }
    return {"name": name, "type": kind}
