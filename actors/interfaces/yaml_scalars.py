"""Values of unquoted YAML scalars. This is the only place that decides what `on`, `1e-3` or `08` is.

ROS 2 reads YAML in two ways, which disagree about these and similar texts:

| text | `rcl_scalar` | `yaml_scalar` |
|---|---|---|
| `y`, `n` | bool | str |
| `08`, `nan`, `inf`, `0x1p3` | float | str |
| `0b101`, `1_000` | str | int |
| `null`, `~` | str | None |
| `9223372036854775808` | float | int |

`rcl_scalar` follows rcl's parser, which nodes use for parameter files and `-p`. `yaml_scalar` follows PyYAML,
which ROS 2's Python tools use. A launch reads parameters with PyYAML and passes them to nodes, where rcl
reads them again: `launch_scalar`.
"""

from __future__ import annotations

import re
import sys
from decimal import Decimal, InvalidOperation
from typing import Final

Scalar = bool | int | float | str | None

MAX_NUMBER_CHARS: Final = 1000
"""Longer texts are strings: converting them takes quadratic time. An exact double has up to 767 digits."""

_YES: Final = ("yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON")
_NO: Final = ("no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF")
_YAML_WORDS: Final[dict[str, Scalar]] = {
    **dict.fromkeys(_YES, True),
    **dict.fromkeys(_NO, False),
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
}
_RCL_BOOLS: Final = {
    **dict.fromkeys(("Y", "y", *_YES), True),
    **dict.fromkeys(("N", "n", *_NO), False),
}
_DOTTED_WORDS: Final = r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)"

# All texts that C's strtoll (base 0) or strtod converts to their end. Block scalars may start with spaces.
_RCL_NUMBER: Final = re.compile(
    rf"""[ \t\n\v\f\r]*(?:
        (?P<int>[-+]?(?:0[xX](?P<hex>[0-9a-fA-F]+) | (?P<octal>0[0-7]*) | [1-9][0-9]*))
      | (?P<float>[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)
      | (?P<hexfloat>[-+]?0[xX](?:[0-9a-fA-F]+\.?[0-9a-fA-F]*|\.[0-9a-fA-F]+)(?:[pP][-+]?[0-9]+)?)
      | (?P<word>[-+]?(?i:inf|infinity|nan))
      | [-+]?(?i:nan)\([0-9A-Za-z_]*\)
    )|(?P<dotted>{_DOTTED_WORDS})""",
    re.VERBOSE,
)
_YAML_NUMBER: Final = re.compile(
    rf"""(?P<int>[-+]?(?:
            0b(?P<binary>[01_]+) | 0x(?P<hex>[0-9a-fA-F_]+) | (?P<octal>0[0-7_]*) | [1-9][0-9_]*
        ))
      | (?P<float>[-+]?(?:[0-9][0-9_]*\.[0-9_]*|\.[0-9][0-9_]*|[0-9][0-9_]*(?=[eE]))(?:[eE][-+]?[0-9]+)?)
      | (?P<dotted>{_DOTTED_WORDS})""",
    re.VERBOSE,
)
_INFINITE: Final = frozenset({float("inf"), float("-inf")})
_INT64: Final = range(-(1 << 63), 1 << 63)


def rcl_scalar(text: str) -> bool | int | float | str:
    """Return the value of an unquoted text in a parameter file or after `-p name:=`.

    Args:
        text: The text.
    """
    value = _RCL_BOOLS.get(text)
    if value is not None:
        return value
    match = _RCL_NUMBER.fullmatch(text)
    if match is None or len(text) > MAX_NUMBER_CHARS:
        return text
    kind = match.lastgroup
    if kind == "int":
        integer = _integer(match["int"], match)
        # rcl falls back on strtod for integers beyond 64 bits. It reads hexadecimal but no octal numbers.
        number = match["int"] if match["hex"] is None else str(integer)
        return integer if integer in _INT64 else _double(number, text)
    if kind == "float":
        return _double(match["float"], text)
    if kind == "hexfloat":
        return _hexadecimal(match["hexfloat"], text)
    return float(match["dotted"].replace(".", "") if kind == "dotted" else match["word"] or "nan")


def yaml_scalar(text: str) -> Scalar:
    """Return the value of an unquoted text by the rules of PyYAML (YAML 1.1), without those that surprise.

    Unlike in PyYAML, `12:30` and dates are strings, and `1e3` is a number.

    Args:
        text: The text.
    """
    if text in _YAML_WORDS:
        return _YAML_WORDS[text]
    match = _YAML_NUMBER.fullmatch(text)
    if match is None or len(text) > MAX_NUMBER_CHARS:
        return text
    digits = text.replace("_", "")
    kind = match.lastgroup
    try:
        if kind == "dotted":
            return float(digits.replace(".", ""))
        value = float(digits) if kind == "float" else _integer(digits, match)
    except ValueError:
        return text  # no digits: `0x_`
    # A number that is out of range stays a string.
    return text if value in _INFINITE else value


def launch_scalar(text: str) -> bool | int | float | str:
    """Return the value of an unquoted text that a launch gives to a node as a parameter.

    Args:
        text: The text.
    """
    value = yaml_scalar(text)
    if value is None or isinstance(value, str):
        return rcl_scalar(text)
    # The node gets the digits, and rcl makes a double of an integer beyond 64 bits.
    return _double(str(value), text) if isinstance(value, int) and value not in _INT64 else value


def _integer(digits: str, match: re.Match[str]) -> int:
    if match["hex"] is not None:
        return int(digits, 16)
    if match.groupdict().get("binary") is not None:
        return int(digits, 2)
    return int(digits, 8 if match["octal"] is not None else 10)


def _double(number: str, text: str) -> float | str:
    """Return a number as strtod converts it; the text where strtod reports that it is out of range."""
    value = float(number)
    if abs(value) >= sys.float_info.min:
        return text if value in _INFINITE else value
    # strtod also reports numbers that are too small to be exact.
    try:
        return value if Decimal(number) == Decimal(value) else text
    except InvalidOperation:
        return text


def _hexadecimal(number: str, text: str) -> float | str:
    try:
        value = float.fromhex(number)
    except OverflowError:
        return text
    digits = number.lower().partition("x")[2].partition("p")[0]
    return text if not value and digits.strip("0.") else value
