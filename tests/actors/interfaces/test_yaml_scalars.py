"""What unquoted texts are, by rcl's rules, PyYAML's, and both, as a launch has them.

tests/real_ros compares the rules with the real parsers, for any text; here are the values that those gave
for the texts that people write.
"""

from __future__ import annotations

import math
import re
import time
from pathlib import Path

import pytest

from actors.interfaces.yaml_reader import load_yaml
from actors.interfaces.yaml_scalars import launch_scalar, rcl_scalar, yaml_scalar
from actors.parameters.file_parser import parse_parameter_value

ROOT = Path(__file__).resolve().parents[3]

# The text; what rcl makes of it; what PyYAML does, where it is something else.
CASES: list[tuple[object, ...]] = [
    ("1", 1),
    ("+1", 1),
    ("-0", 0),
    ("010", 8),
    ("0777", 511),
    ("08", 8.0, "08"),
    ("-09", -9.0, "-09"),
    ("0x1F", 31),
    ("-0x1F", -31),
    ("0xA.8", 10.5, "0xA.8"),
    ("0x1P-2", 0.25, "0x1P-2"),
    ("0x", "0x"),
    ("0o17", "0o17"),
    ("0b101", "0b101", 5),
    ("1_000", "1_000", 1000),
    ("1_0.5", "1_0.5", 10.5),
    ("9223372036854775807", 9223372036854775807),
    ("9223372036854775808", 9223372036854775808.0, 9223372036854775808),
    ("-9223372036854775809", -9223372036854775809.0, -9223372036854775809),
    ("0x8000000000000000", 9223372036854775808.0, 9223372036854775808),
    ("1.5", 1.5),
    ("5.", 5.0),
    (".5", 0.5),
    ("1.5e-3", 0.0015),
    ("1e400", "1e400"),
    ("1e-400", "1e-400", 0.0),
    ("4e-320", "4e-320", 4e-320),
    (".inf", math.inf),
    ("-.INF", -math.inf),
    ("inf", math.inf, "inf"),
    ("-Infinity", -math.inf, "-Infinity"),
    (".nan", math.nan),
    ("NaN", math.nan, "NaN"),
    ("nan(12)", math.nan, "nan(12)"),
    ("-.nan", "-.nan"),
    ("true", True),
    ("No", False),
    ("on", True),
    ("OFF", False),
    ("y", True, "y"),
    ("N", False, "N"),
    ("yEs", "yEs"),
    ("null", "null", None),
    ("~", "~", None),
    ("a", "a"),
    ("1d", "1d"),
    ("1.0.0", "1.0.0"),
    ("=", "="),
]
# What PyYAML surprises with: callboard's answer by its rules is rcl's.
SURPRISES: list[tuple[str, object]] = [
    ("1e3", 1000.0),
    ("1e-3", 0.001),
    ("1.5e3", 1500.0),
    ("+.5", 0.5),
    ("-.5", -0.5),
    ("12:30", "12:30"),
    ("1:30.5", "1:30.5"),
    ("2020-01-01", "2020-01-01"),
    ("2020-01-01 00:00:00", "2020-01-01 00:00:00"),
]


def alike(one: object, other: object) -> bool:
    return type(one) is type(other) and (one == other or str(one) == str(other) == "nan")


@pytest.mark.parametrize(("text", "rcl", "pyyaml"), [(each[0], each[1], each[-1]) for each in CASES])
def test_rules(text: str, rcl: object, pyyaml: object) -> None:
    """rcl's value, PyYAML's, and a launch's: what is a text for PyYAML is read again by rcl."""
    assert alike(rcl_scalar(text), rcl)
    assert alike(yaml_scalar(text), pyyaml)
    integer = isinstance(pyyaml, int) and abs(pyyaml) < 1 << 63
    assert alike(launch_scalar(text), pyyaml if integer or isinstance(pyyaml, float) else rcl)


def test_octal_numbers_that_are_no_integers() -> None:
    """rcl reads them as doubles, which have no octal digits; PyYAML hands a launch the integer."""
    assert alike(rcl_scalar("01777777777777777777777"), 1777777777777777777777.0)
    assert alike(launch_scalar("01777777777777777777777"), 18446744073709551616.0)


@pytest.mark.parametrize(("text", "value"), SURPRISES)
def test_what_pyyaml_surprises_with(text: str, value: object) -> None:
    """Times and dates are texts, and numbers with an exponent are numbers, by all rules."""
    assert alike(rcl_scalar(text), value)
    assert alike(yaml_scalar(text), value)
    assert alike(launch_scalar(text), value)


@pytest.mark.parametrize(
    "text", ["9" * 100_000, "0x" + "f" * 100_000, "1" + "_1" * 50_000, "0." + "1" * 100_000, "1:" * 50_000]
)
def test_long_numbers_are_texts(text: str) -> None:
    """A text of more characters than any number needs is not converted, which would take long."""
    start = time.process_time()
    assert [rules(text) for rules in (rcl_scalar, yaml_scalar, launch_scalar)] == [text] * 3
    assert time.process_time() - start < 1


def test_the_reference_is_right() -> None:
    """Each text in the reference's table has the types that the table says."""
    lines = iter((ROOT / "docs" / "reference" / "parameter-files.md").read_text().splitlines())
    for line in lines:
        if line == "| text | rcl | YAML 1.1 |":
            break
    next(lines)
    names = {"bool": bool, "integer": int, "double": float, "string": str, "a list of one type": list}
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in iter(lines.__next__, "")]
    assert len(rows) > 8
    for texts, rcl, pyyaml in rows:
        for text in re.findall("`([^`]+)`", texts):
            assert type(parse_parameter_value(text)) is names[rcl]
            if pyyaml in names:
                assert type(load_yaml(text)) is names[pyyaml]
            else:  # refused
                assert load_yaml(text) is None
