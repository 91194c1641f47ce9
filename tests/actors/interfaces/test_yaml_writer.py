"""What is written is read equal, by rcl's rules and by PyYAML; tests/real_ros asks rcl itself."""

from __future__ import annotations

from typing import Any

import pytest
import yaml
from hypothesis import given

from actors.interfaces.yaml_writer import block_text, flow_text
from actors.parameters.dumping import parameter_file_text
from actors.parameters.file_parser import parse_parameter_file, parse_parameter_value
from actors.parameters.types import Parameter
from tests.parameter_values import parameters, values


def read_by_pyyaml(text: str) -> dict[str, Any]:
    """Return the parameters of a file as `ros2 param load` has them."""
    found: dict[str, Any] = {}

    def walk(prefix: str, below: dict[str, Any]) -> None:
        for name, value in below.items():
            if isinstance(value, dict):
                walk(f"{prefix}{name}.", value)  # pyright: ignore[reportUnknownArgumentType]
            else:
                found[prefix + name] = value

    walk("", yaml.safe_load(text)["/n"]["ros__parameters"])
    return found


@given(values)
def test_a_value_in_one_line_is_read_equal(value: object) -> None:
    """Any scalar or list; compared by their texts, which tell 1, 1.0 and True apart."""
    text = flow_text(value)
    assert "\n" not in text
    assert repr(parse_parameter_value(text)) == repr(value)
    assert repr(yaml.safe_load(text)) == repr(value)


@given(parameters)
def test_a_file_is_read_equal(given: dict[str, Any]) -> None:
    """Any names, also with empty levels, and those that are longer than libyaml's keys."""
    text = parameter_file_text("/n", [Parameter(name, value=value) for name, value in given.items()])
    found = {name: value for _, name, value in parse_parameter_file(text.encode())}
    assert {name: repr(value) for name, value in found.items()} == {n: repr(v) for n, v in given.items()}
    assert repr(sorted(read_by_pyyaml(text).items(), key=str)) == repr(sorted(given.items(), key=str))


def test_form() -> None:
    """Words without quotes, one line for each element, mappings indented; as `ros2 param dump` writes it."""
    text = block_text(
        {
            "/n": {
                "a": 1,
                "b": [1.5, 1e22],
                "c": {"d": "two words", "e": "y"},
                "f": [],
                "g": {},
                "h": b"\0\xff",
                "h2": b"",
                "i": [True],
                "j": "tab\té\u2028",
                "k" * 100: 5e-324,
            }
        }
    )
    assert text.splitlines()[:-2] == [
        "/n:",
        "  a: 1",
        "  b:",
        "  - 1.5",
        "  - 1.0e+22",
        "  c:",
        "    d: two words",
        '    e: "y"',
        "  f: []",
        "  g: {}",
        '  h: !!binary "AP8="',
        "  h2: []",
        "  i:",
        "  - true",
        '  j: "tab\\té\\u2028"',
    ]
    assert yaml.safe_load(text)["/n"]["k" * 100] == 5e-324


@pytest.mark.parametrize(
    ("value", "error"), [(object(), TypeError), (None, TypeError), ("\ud800", ValueError)]
)
def test_what_cannot_be_written_is_an_error(value: object, error: type[Exception]) -> None:
    """Nothing is written that no reader could read."""
    with pytest.raises(error):
        flow_text(value)
